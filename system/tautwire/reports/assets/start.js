// Last, when all kinds of panels are known.
if (report.choices.length > 0) start();

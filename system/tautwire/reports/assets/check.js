// What was read of a recording: measured curves, and what the robot file makes of others, over time or over travel.

panelKinds.check = (choice, place) => {
  const { title, label, unit, xTitle, curves, range, numbers } = choice.channels[place];
  if (range.length === 0) return { numbers: "", words: `${title}, ${label}: no finite value.`, empty: "No finite value" };
  const colour = colours();
  const hover = { hovertemplate: `%{y:.5~r} ${unit}` };
  const traces = curves.map(({ name, x, y, broad }) => {
    const shade = colour[broad ? "before" : "accent"];
    return lineTrace(name, x, y, shade, { ...hover, ...(broad ? behind(shade) : {}) });
  });
  const axes = { xaxis: axis(colour, xTitle, { hoverformat: ".5~r" }), yaxis: axis(colour, unit) };
  const words = `${title}, ${label}: from ${range[0]} to ${range[1]} ${unit}; ${numbers}.`;
  return { numbers, words, traces, layout: layout(colour, axes) };
};

panelKinds.travel = panelKinds.check;

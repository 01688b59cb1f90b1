// What a run showed over time, and what was recorded of it.

function outputPanel(choice, place, isTall) {
  const channel = choice.channels[place];
  const what = `${channel.title} over time, ${channel.label}`;
  if (channel.range.length === 0) return { numbers: "", words: `${what}: no finite value.`, empty: "No finite value" };
  const colour = colours();
  const [low, high] = channel.range;
  const unit = ` ${channel.unit}`;
  const hover = { hovertemplate: `%{y:.${channel.digits}~r}${unit}` };
  const traces = [lineTrace("co-simulated", channel.time, channel.values, colour.accent, hover)];
  const axes = { xaxis: axis(colour, "Time (s)", { hoverformat: ".4~g" }), yaxis: axis(colour, channel.unit) };
  let words = `${what}: from ${low} to ${high}${unit}`;
  if (channel.recorded) {
    const { time, values } = channel.recorded;
    traces[0].line = { color: colour.accent, width: 1.75 };
    traces.unshift(lineTrace("recorded", time, values, colour.before, { ...hover, ...behind(colour.before) }));
  }
  if (channel.difference && isTall) {
    const { time, values, apart, unit, name } = channel.difference;
    const more = { yaxis: "y2", hovertemplate: `%{y:.3~g} ${unit}`, line: { color: colour.text, width: 1 } };
    traces.push(lineTrace(name, time, values, colour.text, more));
    axes.xaxis.anchor = "y2";
    axes.yaxis.domain = [0.42, 1];
    axes.yaxis2 = axis(colour, unit, { domain: [0, 0.3], nticks: 4, zeroline: true, zerolinecolor: colour["strong-rule"] });
    words += `; ${name} has a root mean square of ${apart} ${unit}`;
  }
  return { numbers: `${low} to ${high}${unit}`, words: `${words}.`, traces, layout: layout(colour, axes) };
}

panelKinds.output = (choice, place) => outputPanel(choice, place, false);
panelKinds.compared = (choice, place) => outputPanel(choice, place, true);

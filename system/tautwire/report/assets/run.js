// What a run showed over time, beside what was recorded.

panelKinds.output = (choice, place) => {
  const channel = choice.channels[place];
  const what = `${channel.title} over time, ${channel.label}`;
  if (channel.range.length === 0) return { numbers: "", words: `${what}: no finite value.`, empty: "No finite value" };
  const colour = colours();
  const [low, high] = channel.range;
  const hover = { hovertemplate: `%{y:.5~g} ${channel.unit}` };
  const traces = [lineTrace("co-simulated", channel.time, channel.values, colour.accent, hover)];
  let words = `${what}: from ${low} to ${high} ${channel.unit}`;
  if (channel.recorded) {
    const { time, values, apart } = channel.recorded;
    // Behind: a measured line has noise, and would cover the other one.
    traces.unshift(lineTrace("recorded", time, values, colour.before, hover));
    words += `; root mean square from the recording ${apart} ${channel.unit}`;
  }
  const axes = { xaxis: axis(colour, "Time (s)", { hoverformat: ".4~g" }), yaxis: axis(colour, channel.unit) };
  return { numbers: `${low} to ${high} ${channel.unit}`, words: `${words}.`, traces, layout: layout(colour, axes) };
};

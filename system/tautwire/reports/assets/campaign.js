// Spreads of many runs: bands over time, and how often an output lies where.

const variant = () => report.variants[state.choice];
const againstInput = document.getElementById("against");

panelKinds.band = (_, place) => {
  const channel = variant().bands[place];
  const what = `${channel.title} over time, ${channel.label}`;
  if (channel.middle === null) return { numbers: "", words: `${what}: no values.`, empty: "No values" };
  const colour = colours();
  const time = variant().time;
  const hover = { hovertemplate: `%{y:.5~g} ${channel.unit}` };
  const edge = { ...hover, line: { color: colour.accent, width: 0.5 } };
  const traces = [
    lineTrace("2.5 %", time, channel.low, colour.accent, edge),
    lineTrace("97.5 %", time, channel.high, colour.accent, { ...edge, fill: "tonexty", fillcolor: colour.band }),
    lineTrace("median", time, channel.middle, colour.accent, hover),
  ];
  const axes = { xaxis: axis(colour, "Time (s)", { hoverformat: ".4~g" }), yaxis: axis(colour, channel.unit) };
  const numbers = `band up to ${channel.width} ${channel.unit} wide`;
  return { numbers, words: `${what}: median and central 95 % of runs, ${numbers}.`, traces, layout: layout(colour, axes) };
};

panelKinds.spread = (_, place) => {
  const output = variant().spreads[place];
  const what = `Histogram of ${output.label}`;
  if (output.edges === null) return { numbers: "", words: `${what}: no values.`, empty: "No values" };
  const colour = colours();
  const edges = series(output.edges), counts = series(output.counts);
  const width = edges[1] - edges[0];
  // Steps halfway between the middles of bins, with an empty bin at either end; the plotly bundle has no bars.
  const x = [edges[0], ...edges].map((edge, k) => edge + (k === 0 ? -0.5 : 0.5) * width);
  const traces = [{
    type: "scatter", mode: "lines", name: "runs", x, y: [0, ...counts, 0], fill: "tozeroy", fillcolor: colour.accent,
    line: { shape: "hvh", width: 0 }, hovertemplate: "%{y} runs",
  }];
  const shapes = output.quantiles.map((value) => ({
    type: "line", yref: "paper", y0: 0, y1: 1, x0: value, x1: value, line: { color: colour.text, width: 1, dash: "dot" },
  }));
  const range = [edges[0], edges[edges.length - 1]];
  const axes = { xaxis: axis(colour, output.unit, { hoverformat: ".5~g", range }), yaxis: axis(colour, "Runs"), shapes };
  const columns = [["from", edges.slice(0, -1)], ["to", edges.slice(1)]].map(([end, values]) => [`${end} (${output.unit})`, values]);
  const words = `${what}: 95 % of runs lie within ${output.words}.`;
  return { numbers: output.words, words, traces, layout: layout(colour, axes), columns: [...columns, ["runs", counts]] };
};

panelKinds.against = (_, place) => {
  const output = variant().spreads[place];
  const input = report.inputs[Number(againstInput ? againstInput.value : 0)];
  const what = `${output.label} over ${input.label}`;
  if (output.values === null) return { numbers: "", words: `${what}: no values.`, empty: "No values" };
  const colour = colours();
  const traces = [{
    type: "scatter", mode: "markers", name: output.label, x: series(variant().inputs[input.place]),
    y: series(output.values), marker: { color: colour.accent, size: 5, opacity: 0.7 },
    hovertemplate: `%{y:.5~g} ${output.unit}`,
  }];
  const axes = { xaxis: axis(colour, input.label, { hoverformat: ".5~g" }), yaxis: axis(colour, output.unit), hovermode: "closest" };
  return { numbers: output.words, words: `${what}: from ${output.words}.`, traces, layout: layout(colour, axes) };
};

function startCampaign() {
  for (const figure of document.querySelectorAll("figure")) watcher.observe(figure);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraw("figure"));
  window.addEventListener("beforeprint", preparePrint);
  if (againstInput) againstInput.addEventListener("change", () => redraw("figure[data-kind=against]"));
  const chosenNow = radio("choice", (value) => {
    state.choice = Number(value);
    state.span = null;
    redraw("figure");
  });
  state.choice = Number(chosenNow ?? 0);
  redraw("figure");
}

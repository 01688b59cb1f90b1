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
  const x = counts.map((_, k) => 0.5 * (edges[k] + edges[k + 1]));
  const width = counts.map((_, k) => edges[k + 1] - edges[k]);
  const traces = [{
    type: "bar", name: "runs", x, y: counts, width, marker: { color: colour.accent, line: { width: 0 } },
    hovertemplate: "%{y} runs",
  }];
  const shapes = output.quantiles.map((value) => ({
    type: "line", yref: "paper", y0: 0, y1: 1, x0: value, x1: value, line: { color: colour.text, width: 1, dash: "dot" },
  }));
  const axes = { xaxis: axis(colour, output.unit, { hoverformat: ".5~g" }), yaxis: axis(colour, "Runs"), bargap: 0, shapes };
  return { numbers: output.words, words: `${what}: 95 % of runs lie within ${output.words}.`, traces, layout: layout(colour, axes) };
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
  window.addEventListener("beforeprint", () => [...stale].forEach(drawFigure));
  if (againstInput) againstInput.addEventListener("change", () => redraw("figure[data-kind=against]"));
  const chosenNow = radio("choice", (value) => {
    state.choice = Number(value);
    redraw("figure");
  });
  state.choice = Number(chosenNow ?? 0);
  redraw("figure");
}

startCampaign();

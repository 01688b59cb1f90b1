// Spreads of many runs: bands over time, and how often an output lies where.

const variant = () => report.variants[state.choice];
const againstInput = document.getElementById("against");

panelKinds.band = (_, place) => {
  const channel = variant().bands[place];
  const what = `${channel.title} over time, ${channel.label}`;
  if (channel.middle === null) return { numbers: "", words: `${what}: no values.`, empty: "No values" };
  const colour = colours();
  const time = variant().time, [low, high] = [series(channel.low), series(channel.high)];
  const middle = series(channel.middle);
  const above = (ends) => middle.map((value, i) => (value === null || ends[i] === null ? null : value + ends[i]));
  // Quaternions have no unit.
  const unit = channel.unit && ` ${channel.unit}`;
  const hover = { hovertemplate: `%{y:.7~r}${unit}` };
  const line = (name, y, more) => ({ ...lineTrace(name, time, channel.middle, colour.text, hover), y, ...more });
  const edge = { line: { color: colour["band-fill"], width: 1 } };
  const fill = { ...edge, fill: "tonexty", fillcolor: colour["band-fill"] };
  const below = { yaxis: "y2", hovertemplate: `%{y:.3~g}${unit}` };
  const traces = [
    line("2.5th percentile", above(low), edge), line("97.5th percentile", above(high), fill),
    line("median", middle),
    line("2.5th percentile minus median", low, { ...edge, ...below }),
    line("97.5th percentile minus median", high, { ...fill, ...below }),
  ];
  const axes = {
    xaxis: axis(colour, "Time (s)", { hoverformat: ".4~g", anchor: "y2" }),
    yaxis: axis(colour, channel.unit || "1", { domain: [0.46, 1] }),
    yaxis2: axis(colour, channel.unit || "1", { domain: [0, 0.34], nticks: 4 }),
    shapes: [{ ...levelLine(0, { color: colour.text, width: 1 }), yref: "y2" }],
  };
  const numbers = `band up to ${channel.width}${unit} wide`;
  const words = `${what}: median and 2.5th to 97.5th percentile of runs, ${numbers}.`;
  return { numbers, words, traces, layout: layout(colour, axes) };
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
    hovertemplate: `%{y:.6~r} ${output.unit}`,
  }];
  const axes = { xaxis: axis(colour, input.label, { hoverformat: ".5~g" }), yaxis: axis(colour, output.unit), hovermode: "closest" };
  return { numbers: output.words, words: `${what}: from ${output.words}.`, traces, layout: layout(colour, axes) };
};

function startCampaign() {
  for (const figure of document.querySelectorAll("figure")) watcher.observe(figure);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraw("figure"));
  window.addEventListener("beforeprint", preparePrint);
  window.addEventListener("afterprint", finishPrint);
  if (againstInput) againstInput.addEventListener("change", () => redraw("figure[data-kind=against]"));
  const chosenNow = radio("choice", (value) => {
    state.choice = Number(value);
    state.span = null;
    redraw("figure");
  });
  state.choice = Number(chosenNow ?? 0);
  redraw("figure");
}

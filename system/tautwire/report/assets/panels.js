// Small figures, one for each output; each kind of page adds its own to panelKinds.

/** A line of a panel from packed numbers. */
function lineTrace(name, x, y, shade, more) {
  return {
    type: "scatter", mode: "lines", name, x: series(x), y: series(y), connectgaps: false,
    line: { color: shade, width: 1.25 }, hovertemplate: "%{y:.3~g}", ...more,
  };
}

/** A line across a panel at one value of y. */
function levelLine(level, line) {
  return { type: "line", xref: "paper", x0: 0, x1: 1, y0: level, y1: level, line };
}

const logarithmic = { type: "log", dtick: 1, tickformat: ".6~g" };

/** A logarithmic axis over frequencies, with ticks at 1, 2 and 5 where there is room for these. */
function frequencyAxis(colour, frequencies, more) {
  const known = frequencies.filter((value) => value > 0);
  const [low, high] = [Math.min(...known), Math.max(...known)];
  const decades = Array.from({ length: 40 }, (_, place) => 10 ** (place - 20));
  const steps = high / low < 200 ? [1, 2, 5] : [1];
  const tickvals = decades.flatMap((decade) => steps.map((step) => step * decade)).filter((f) => f >= low && f <= high);
  const ticktext = tickvals.map((value) => String(Number(value.toPrecision(3))));
  return axis(colour, "Frequency (Hz)", { type: "log", tickmode: "array", tickvals, ticktext, hoverformat: ".3~g", ...more });
}

/** Bands over frequencies with a label above each, and the room that the labels need; for logarithmic axes. */
function frequencyBands(bands, colour) {
  const shapes = bands.map(({ low, high, strange }) => ({
    type: "rect", yref: "paper", y0: 0, y1: 1, x0: low, x1: high, layer: "below",
    fillcolor: strange ? colour["warn-band"] : colour["mode-band"],
    line: { color: strange ? colour.warn : colour.mode, width: 1 },
  }));
  const annotations = bands.map(({ low, high, label, strange }) => ({
    text: label, showarrow: false, x: 0.5 * (Math.log10(low) + Math.log10(high)), yref: "paper", y: 1,
    yanchor: "bottom", font: { size: 11, color: strange ? colour.warn : colour.mode },
  }));
  return { shapes, annotations, margin: { l: 8, r: 8, t: bands.length ? 20 : 4, b: 8 } };
}

/**
 * Draw what a panel's kind makes of a choice.
 *
 * A kind gives traces and layout, or why there is nothing to draw (empty); numbers for the caption; words for those
 * who cannot see the figure.
 */
function drawPanel(panel, choice, scale) {
  const drawn = panelKinds[panel.dataset.kind](choice, Number(panel.dataset.channel), scale);
  const plot = panel.querySelector(".plot");
  panel.querySelector(".numbers").textContent = drawn.numbers;
  plot.setAttribute("aria-label", drawn.words);
  plot.classList.toggle("empty", Boolean(drawn.empty));
  if (drawn.empty) {
    Plotly.purge(plot);
    plot.textContent = drawn.empty;
    return;
  }
  if (!plot.classList.contains("js-plotly-plot")) plot.textContent = "";
  Plotly.react(plot, drawn.traces, drawn.layout, config);
}

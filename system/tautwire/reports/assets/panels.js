// Small figures, one for each output; each kind of page adds its own to panelKinds.

/** A line of a panel from packed numbers. */
function lineTrace(name, x, y, shade, more) {
  return {
    type: "scatter", mode: "lines", name, x: series(x), y: series(y), connectgaps: false,
    line: { color: shade, width: 1.25 }, hovertemplate: "%{y:.3~g}", ...more,
  };
}

/** How to draw a line that another one may cover: so broad that both are seen where they agree. */
function behind(shade) {
  return { line: { color: shade, width: 4.5 } };
}

/** A line across a panel at one value of y. */
function levelLine(level, line) {
  return { type: "line", xref: "paper", x0: 0, x1: 1, y0: level, y1: level, line };
}

/** The least and the largest of numbers that a logarithmic axis can show. */
function positiveRange(values) {
  const known = values.filter((value) => value > 0);
  return known.length ? [Math.min(...known), Math.max(...known)] : [0.1, 1];
}

/** A logarithmic axis from low to high, with ticks at 1, 2 and 5 where fewer than ``most`` come of that. */
function logAxis(colour, title, [low, high], most, more) {
  const decades = Array.from({ length: 40 }, (_, place) => 10 ** (place - 20));
  const ticks = [[1, 2, 5], [1, 3], [1]].map((steps) => decades.flatMap((decade) => steps.map((step) => step * decade))
    .filter((value) => value >= 0.99 * low && value <= 1.01 * high));
  const tickvals = ticks.find((each) => each.length <= most) ?? ticks[2];
  const ticktext = tickvals.map((value) => String(Number(value.toPrecision(3))));
  return axis(colour, title, { type: "log", tickmode: "array", tickvals, ticktext, hoverformat: ".3~g", ...more });
}

function frequencyAxis(colour, frequencies, more) {
  return logAxis(colour, "Frequency (Hz)", positiveRange(frequencies), 7, more);
}

// The share of a panel's width that a letter of a label takes.
const letterShare = 0.027;

/**
 * Bands over frequencies with a label above each, and the room that the labels need; for logarithmic axes.
 *
 * A label that would run into the one before stands a line higher.
 */
function frequencyBands(bands, frequencies, colour) {
  const shapes = bands.flatMap(({ spans, strange }) => spans.map(([x0, x1]) => ({
    type: "rect", yref: "paper", y0: 0, y1: 1, x0, x1, layer: "below",
    fillcolor: strange ? colour["warn-band"] : colour["mode-band"],
    line: { color: strange ? colour.warn : colour.mode, width: 0.75 },
  })));
  const [low, high] = positiveRange(frequencies).map(Math.log10);
  const middle = (band) => 0.5 * (Math.log10(band.low) + Math.log10(band.high));
  let end = -Infinity, line = 0, lines = 0;
  const annotations = [...bands].sort((one, other) => middle(one) - middle(other)).map((band) => {
    const x = middle(band), half = 0.5 * letterShare * (band.label.length + 0.5);
    const share = (x - low) / (high - low);
    line = share - half < end ? line + 1 : 0;
    [end, lines] = [share + half, Math.max(lines, line + 1)];
    return {
      text: band.label, showarrow: false, x, yref: "paper", y: 1, yanchor: "bottom", yshift: 14 * line,
      font: { size: 11, color: band.strange ? colour.warn : colour.mode },
    };
  });
  return { shapes, annotations, margin: { l: 8, r: 8, t: 4 + 16 * lines, b: 8 } };
}

/**
 * What a panel's kind makes of what is chosen.
 *
 * A kind gives traces and layout, or why there is nothing to draw (empty); numbers for the caption; words for those
 * who cannot see the figure; and columns to save where the lines are not the data.
 */
function panelOf(panel) {
  return panelKinds[panel.dataset.kind](chosen(), Number(panel.dataset.channel), state.scale);
}

function drawPanel(panel) {
  const drawn = panelOf(panel);
  const plot = panel.querySelector(".plot");
  panel.querySelector(".tools").hidden = Boolean(drawn.empty);
  panel.querySelector(".numbers").textContent = drawn.numbers;
  plot.setAttribute("aria-label", drawn.words);
  plot.classList.toggle("empty", Boolean(drawn.empty));
  if (drawn.empty) {
    Plotly.purge(plot);
    plot.textContent = drawn.empty;
    return;
  }
  if (state.span && panel.matches(overTime)) drawn.layout.xaxis.range = [...state.span];
  const isNew = !plot.on;
  if (isNew) plot.textContent = "";
  Plotly.react(plot, drawn.traces, drawn.layout, config);
  if (isNew) followZoom(panel, plot);
  fitPaper(plot);
}

// Residuals and their spectra, one small figure for each output.

function residualFigure(recording, channel, scale) {
  const colour = colours();
  const time = series(recording.time);
  const sigma = channel.sigma;
  const line = (name, shade, width) => ({
    type: "scatter", mode: "lines", name, x: time, y: series(channel[name]), line: { color: shade, width },
    hovertemplate: `%{y:.3~g} ${channel.unit}`, connectgaps: false,
    // Close up, the error before runs off the scale and would only be in the way.
    opacity: scale === "left" && name === "before" ? 0.35 : 1,
  });
  const y = axis(colour, channel.unit);
  if (scale === "left") {
    const reach = 1.15 * Math.max(channel.reach, 2.5 * (sigma || 0)) || 1;
    y.range = [-reach, reach];
  }
  // Edges in front: where only noise is left, the residual covers the band.
  const edge = (level) => ({
    type: "line", xref: "paper", x0: 0, x1: 1, y0: level, y1: level, line: { color: colour.text, width: 1, dash: "dot" },
  });
  const band = sigma === null ? [] : [{
    type: "rect", xref: "paper", x0: 0, x1: 1, y0: -2 * sigma, y1: 2 * sigma, fillcolor: colour.band,
    line: { width: 0 }, layer: "below",
  }, edge(-2 * sigma), edge(2 * sigma)];
  return {
    traces: [line("before", colour.before, 1), line("after", colour.accent, 1)],
    layout: layout(colour, { xaxis: axis(colour, "Time (s)", { hoverformat: ".4~g" }), yaxis: y, shapes: band }),
  };
}

function spectrumFigure(recording, channel) {
  const colour = colours();
  const found = channel.spectrum;
  const frequency = series(found.frequency);
  const line = (name, shade) => ({
    type: "scatter", mode: "lines", name, x: frequency, y: series(found[name]), line: { color: shade, width: 1.25 },
    hovertemplate: "%{y:.3~g}",
  });
  const floor = found.floor === null ? [] : [{
    type: "line", xref: "paper", x0: 0, x1: 1, y0: found.floor, y1: found.floor,
    line: { color: colour.text, width: 1, dash: "dash" },
  }];
  const logarithmic = { type: "log", dtick: 1, tickformat: ".6~g" };
  return {
    traces: [line("before", colour.before), line("after", colour.accent)],
    layout: layout(colour, {
      xaxis: axis(colour, "Frequency (Hz)", { ...logarithmic, hoverformat: ".3~g" }),
      yaxis: axis(colour, `${channel.unit}/√Hz`, logarithmic), shapes: floor,
    }),
  };
}

/** Say in words what a panel shows, for its caption and for those who cannot see it. */
function describePanel(panel, recording, channel) {
  const [before, after] = channel.rms;
  const known = channel.before !== null;
  panel.querySelector(".numbers").textContent = known ? `${before} → ${after} ${channel.unit}` : "";
  const what = panel.dataset.kind === "residual" ? "Residual over time" : "Spectrum of the residual";
  const noise = channel.sigma === null ? "" : `, noise ${significant(channel.sigma)} ${channel.unit}`;
  const numbers = known
    ? `root mean square ${before} ${channel.unit} before, ${after} ${channel.unit} after${noise}`
    : "not measured";
  panel.querySelector(".plot").setAttribute("aria-label", `${what}, ${channel.label}, ${recording.label}: ${numbers}.`);
}

function drawPanel(panel, recording, scale) {
  const channel = recording.channels[Number(panel.dataset.channel)];
  const plot = panel.querySelector(".plot");
  const isResidual = panel.dataset.kind === "residual";
  describePanel(panel, recording, channel);
  const empty = isResidual ? channel.before === null : channel.spectrum === null;
  plot.classList.toggle("empty", empty);
  if (empty) {
    Plotly.purge(plot);
    plot.textContent = channel.before === null ? "Not measured in this recording" : "Too short for a spectrum";
    return;
  }
  if (!plot.classList.contains("js-plotly-plot")) plot.textContent = "";
  const figure = isResidual ? residualFigure(recording, channel, scale) : spectrumFigure(recording, channel);
  Plotly.react(plot, figure.traces, figure.layout, config);
}

// What a trace's models leave: residuals over time, and their spectra.

/** Words and numbers that say the same as the figure. */
function told(choice, channel, what) {
  const [before, after] = channel.rms;
  if (channel.before === null) return { numbers: "", words: `${what}, ${channel.label}, ${choice.label}: not measured.` };
  const noise = channel.sigma === null ? "" : `, noise ${significant(channel.sigma)} ${channel.unit}`;
  return {
    numbers: `${before} → ${after} ${channel.unit}`,
    words: `${what}, ${channel.label}, ${choice.label}: root mean square ${before} ${channel.unit} before, `
      + `${after} ${channel.unit} after${noise}.`,
  };
}

/** The noise band of a residual, with its edges in front: where only noise is left, the residual covers the band. */
function noiseBand(sigma, colour) {
  if (sigma === null) return [];
  const edge = { color: colour.text, width: 1, dash: "dot" };
  const band = {
    type: "rect", xref: "paper", x0: 0, x1: 1, y0: -2 * sigma, y1: 2 * sigma, fillcolor: colour.band,
    line: { width: 0 }, layer: "below",
  };
  return [band, levelLine(-2 * sigma, edge), levelLine(2 * sigma, edge)];
}

panelKinds.residual = (choice, place, scale) => {
  const channel = choice.channels[place];
  const said = told(choice, channel, "Residual over time");
  if (channel.before === null) return { ...said, empty: "Not measured in this recording" };
  const colour = colours();
  const line = (name, shade) => lineTrace(name, choice.time, channel[name], shade, {
    line: { color: shade, width: 1 }, hovertemplate: `%{y:.3~g} ${channel.unit}`,
    // Close up, the error before runs off the scale and would only be in the way.
    opacity: scale === "left" && name === "before" ? 0.35 : 1,
  });
  const y = axis(colour, channel.unit);
  if (scale === "left") {
    const reach = 1.15 * Math.max(channel.reach, 2.5 * (channel.sigma || 0)) || 1;
    y.range = [-reach, reach];
  }
  const x = axis(colour, "Time (s)", { hoverformat: ".4~g" });
  return {
    ...said, traces: [line("before", colour.before), line("after", colour.accent)],
    layout: layout(colour, { xaxis: x, yaxis: y, shapes: noiseBand(channel.sigma, colour) }),
  };
};

panelKinds.spectrum = (choice, place) => {
  const channel = choice.channels[place];
  const said = told(choice, channel, "Spectrum of the residual");
  if (channel.before === null) return { ...said, empty: "Not measured in this recording" };
  if (channel.spectrum === null) return { ...said, empty: "Too short for a spectrum" };
  const colour = colours();
  const found = channel.spectrum;
  const densities = positiveRange([...series(found.before), ...series(found.after)]);
  const noise = { color: colour.text, width: 1, dash: "dash" };
  const frequencies = series(found.frequency);
  const { shapes, ...room } = frequencyBands(choice.bands, frequencies, colour);
  const floor = found.floor === null ? [] : [levelLine(found.floor, noise)];
  return {
    ...said, words: [said.words, ...choice.bands.map((band) => `${band.words}.`)].join(" "),
    traces: [
      lineTrace("before", found.frequency, found.before, colour.before, behind(colour.before)),
      lineTrace("after", found.frequency, found.after, colour.accent),
    ],
    layout: layout(colour, {
      xaxis: frequencyAxis(colour, frequencies), yaxis: logAxis(colour, `${channel.unit}/√Hz`, densities, 5),
      shapes: [...shapes, ...floor], ...room,
    }),
  };
};

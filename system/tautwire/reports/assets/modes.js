// Gain and phase of a linear plant from the chosen input.

const source = document.getElementById("source");
source.addEventListener("change", () => redraw("figure[data-kind=gain]"));

/** Right angles between ticks, or more of them where the phase turns far. */
function phaseTick(phase) {
  const known = phase.filter((value) => value !== null);
  return 90 * Math.max(1, Math.ceil((Math.max(...known) - Math.min(...known)) / 280));
}

panelKinds.gain = (choice, place) => {
  const output = report.gains[place];
  const { gain, phase, peak, unit, by } = output.from[Number(source.value)];
  const what = `Gain and phase over frequency, ${output.label} by ${by}`;
  if (gain === null) return { numbers: "", words: `${what}: none.`, empty: "This input has no effect here" };
  const colour = colours();
  const frequencies = series(report.frequency);
  const { shapes, ...room } = frequencyBands(report.bands, frequencies, colour);
  const traces = [
    lineTrace("gain", report.frequency, gain, colour.accent, { hovertemplate: `%{y:.3~g} ${unit}` }),
    lineTrace("phase", report.frequency, phase, colour.accent, { yaxis: "y2", hovertemplate: "%{y:.0f}°" }),
  ];
  const words = `${what}: at most ${peak} ${unit}. ${report.bands.map((band) => `${band.words}.`).join(" ")}`;
  return {
    numbers: `at most ${peak}`, words, traces,
    layout: layout(colour, {
      xaxis: frequencyAxis(colour, frequencies, { anchor: "y2" }),
      yaxis: logAxis(colour, unit, positiveRange(series(gain)), 5, { domain: [0.4, 1] }),
      yaxis2: axis(colour, "Phase (°)", { domain: [0, 0.3], dtick: phaseTick(series(phase)) }), shapes, ...room,
    }),
  };
};

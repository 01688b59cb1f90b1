// Zooming: the figures over time show the same span; a double click undoes the zoom.

const overTime = ["residual", "output", "compared", "band", "check"]
  .map((kind) => `figure[data-kind=${kind}]`).join(", ");

/** Show a span of time in all figures over time, or all of it without one; ``zoomed`` shows it already. */
function showSpan(span, zoomed) {
  state.span = span;
  redraw(overTime, zoomed);
}

function resetZoom(figure) {
  if (figure.classList.contains("scene")) turn(state.view);
  else if (figure.matches(overTime)) showSpan(null);
  else drawFigure(figure);
}

/** Hear of zooms in a panel. */
function followZoom(panel, plot) {
  plot.on("plotly_relayout", (change) => {
    const span = [change["xaxis.range[0]"], change["xaxis.range[1]"]];
    if (panel.matches(overTime) && span.every(Number.isFinite)) showSpan(span, panel);
  });
  // Plotly still handles the click while it tells of it.
  plot.on("plotly_doubleclick", () => setTimeout(() => resetZoom(panel)));
}

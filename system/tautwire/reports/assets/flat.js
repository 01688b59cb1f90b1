// The robot as a drawing without depth, for browsers that have no 3D.

const has3d = Boolean(document.createElement("canvas").getContext("webgl"));
// Azimuth and elevation of the eye.
const angles = {
  perspective: [-0.86, 0.3], close: [-0.86, 0.3], top: [-Math.PI / 2, Math.PI / 2], front: [-Math.PI / 2, 0], side: [0, 0],
};

/** Points seen from far away: x to the right and y up on the screen, in m. */
function seen({ x, y, z }, view) {
  const [azimuth, elevation] = angles[view];
  const [c, s] = [Math.cos(azimuth), Math.sin(azimuth)];
  const at = (make) => x.map((_, i) => (x[i] === null ? null : make(x[i], y[i], z[i])));
  return {
    x: at((px, py) => py * c - px * s),
    y: at((px, py, pz) => pz * Math.cos(elevation) - (px * c + py * s) * Math.sin(elevation)),
  };
}

/** The colour of a share between 0 and 1 of a scale of three. */
function mixed(share, { low, middle, high }) {
  const [from, to, part] = share < 0.5 ? [low, middle, 2 * share] : [middle, high, 2 * share - 1];
  const channel = (k) => {
    const [a, b] = [from, to].map((colour) => parseInt(colour.slice(k, k + 2), 16));
    return Math.round(a + part * (b - a));
  };
  return `rgb(${[1, 3, 5].map(channel).join(",")})`;
}

/** A line for each cable in the colour of its tension. */
function flatCables(cables, view, colour) {
  const { color, cmin, cmax } = cables.line;
  const points = seen(cables, view);
  const shade = (tension) => mixed(Math.min(1, Math.max(0, (tension - cmin) / (cmax - cmin))), colour);
  return report.anchors.map((_, cable) => ({
    type: "scatter", mode: "lines", name: `cable ${cable + 1}`, hoverinfo: "name",
    x: points.x.slice(3 * cable, 3 * cable + 2), y: points.y.slice(3 * cable, 3 * cable + 2),
    line: { width: 3, color: typeof color === "string" ? color : shade(color[3 * cable]) },
  }));
}

/** Draw what the traces of the scene in 3D hold. */
function drawFlat(traces, chosenView, colour) {
  const view = facing(chosen().scene) ?? chosenView;
  const [cables, ...others] = traces;
  const flat = others.map(({ type, hovertemplate, ...trace }) => ({
    ...trace, ...seen(trace, view), z: undefined, type: "scatter", hoverinfo: "name",
    ...(trace.line ? { line: { ...trace.line, width: 1.5 } } : {}),
  }));
  const bare = { visible: false, fixedrange: true };
  const near = chosenView === "close" ? others.slice(2).map((path) => seen(path, view)) : [];
  const range = (name) => {
    const values = near.flatMap((points) => points[name]).filter((value) => value !== null);
    return values.length ? [Math.min(...values), Math.max(...values)] : undefined;
  };
  const axes = { xaxis: { ...bare, range: range("x") }, yaxis: { ...bare, range: range("y"), scaleanchor: "x" } };
  const more = { hovermode: "closest", margin: { l: 24, r: 24, t: 24, b: 24 }, ...axes };
  return Plotly.react(sceneFigure, [...flatCables(cables, view, colour), ...flat], layout(colour, more), config);
}

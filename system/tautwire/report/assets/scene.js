// The robot in space: cables, paths and a slider that moves the platform.

// Places of the traces that the slider moves.
const CABLES = 3, PLATFORM = 5;
const views = {
  perspective: { eye: { x: 1.2, y: -1.4, z: 0.55 }, center: { x: 0, y: 0, z: -0.13 }, up: { x: 0, y: 0, z: 1 } },
  top: { eye: { x: 0, y: 0, z: 2.2 }, up: { x: 0, y: 1, z: 0 } },
  front: { eye: { x: 0, y: -2.2, z: 0 }, up: { x: 0, y: 0, z: 1 } },
  side: { eye: { x: 2.2, y: 0, z: 0 }, up: { x: 0, y: 0, z: 1 } },
};

/** A view from far enough away that all fits into a narrow figure too. */
function camera(name) {
  const { clientWidth, clientHeight } = document.getElementById("scene");
  const further = Math.max(1, 1.25 * clientHeight / Math.max(1, clientWidth));
  const { x, y, z } = views[name].eye;
  return { center: { x: 0, y: 0, z: 0 }, ...views[name], eye: { x: further * x, y: further * y, z: further * z } };
}

/** A path with its distance from the reference drawn ``times`` larger. */
function magnified(path, reference, times) {
  return path.map((column, k) => series(column).map((value, i) => {
    const base = series(reference[k])[i];
    return value === null || base === null ? null : base + times * (value - base);
  }));
}

function positionAt(scene, place) {
  return scene.after.map((column) => series(column)[place]);
}

/** Lines from every anchor to the platform, a gap after each, and the tension along each. */
function cableLines(scene, place) {
  const end = positionAt(scene, place);
  const lines = { x: [], y: [], z: [], tension: [] };
  report.anchors.forEach((anchor, cable) => {
    const tension = series(scene.tension[cable])[place];
    ["x", "y", "z"].forEach((name, k) => lines[name].push(anchor[k], end[k], null));
    lines.tension.push(tension, tension, tension);
  });
  return lines;
}

function pathTrace(name, columns, colour, width, dash) {
  return {
    type: "scatter3d", mode: "lines", name, x: columns[0], y: columns[1], z: columns[2], hoverinfo: "name",
    line: { color: colour, width, dash: dash || "solid" }, connectgaps: false,
  };
}

function cableTrace(scene, place, colour) {
  const lines = cableLines(scene, place);
  let [low, high] = scene.tensionRange;
  if (!(high > low)) high = low + 1;
  return {
    type: "scatter3d", mode: "lines", name: "cables", x: lines.x, y: lines.y, z: lines.z, hoverinfo: "skip",
    connectgaps: false,
    line: {
      width: 8, color: lines.tension, cmin: low, cmax: high, showscale: true,
      colorscale: [[0, colour.low], [0.5, colour.middle], [1, colour.high]],
      colorbar: {
        orientation: "h", thickness: 10, len: 0.5, x: 0.5, y: 0, yanchor: "bottom", outlinewidth: 0, nticks: 5,
        title: { text: "Tension (N)", side: "top", font: { size: 12 } }, tickfont: { color: colour.muted, size: 11 },
      },
    },
  };
}

function pointTraces(scene, place, colour) {
  const column = (k) => report.anchors.map((anchor) => anchor[k]);
  const end = positionAt(scene, place);
  const anchors = {
    type: "scatter3d", mode: "markers+text", name: "exit points", x: column(0), y: column(1), z: column(2),
    text: report.anchors.map((_, cable) => String(cable + 1)), textposition: "top center",
    textfont: { color: colour.text, size: 12 }, marker: { size: 4, color: colour.text },
    hovertemplate: "exit point %{text}<br>%{x:.3f}, %{y:.3f}, %{z:.3f} m<extra></extra>",
  };
  const platform = {
    type: "scatter3d", mode: "markers", name: "platform", x: [end[0]], y: [end[1]], z: [end[2]],
    marker: { size: 7, color: colour.accent, line: { color: colour.surface, width: 2 } },
    hovertemplate: "platform<br>%{x:.4f}, %{y:.4f}, %{z:.4f} m<extra></extra>",
  };
  return [anchors, platform];
}

function sceneLayout(colour) {
  const spatial = (name) => ({
    title: { text: `${name} (m)` }, color: colour.muted, gridcolor: colour["strong-rule"], zerolinecolor: colour["strong-rule"],
    showbackground: false, nticks: 6, showspikes: false,
  });
  return layout(colour, {
    margin: { l: 0, r: 0, t: 0, b: 0 }, hovermode: "closest",
    scene: {
      xaxis: spatial("x"), yaxis: spatial("y"), zaxis: spatial("z"), aspectmode: "data",
      camera: camera("perspective"), dragmode: "turntable", uirevision: "kept", domain: { x: [0, 1], y: [0.1, 1] },
    },
  });
}

function drawScene(recording, place, times) {
  const colour = colours();
  const scene = recording.scene;
  const path = (name) => (scene[name] ? magnified(scene[name], scene.after, times) : [[null], [null], [null]]);
  const traces = [
    pathTrace("measured", path("measured"), colour.measured, 2, "dot"),
    pathTrace("before", path("before"), colour.before, 4),
    pathTrace("after", path("after"), colour.accent, 5),
    cableTrace(scene, place, colour), ...pointTraces(scene, place, colour),
  ];
  return Plotly.react(document.getElementById("scene"), traces, sceneLayout(colour), config);
}

function moveRobot(recording, place) {
  const lines = cableLines(recording.scene, place);
  const end = positionAt(recording.scene, place);
  const [x, y, z] = end.map((value) => [value]);
  Plotly.restyle(document.getElementById("scene"), {
    x: [lines.x, x], y: [lines.y, y], z: [lines.z, z], "line.color": [lines.tension, undefined],
  }, [CABLES, PLATFORM]);
}

/** Tensions of all cables at one time, in words. */
function showTensions(recording, place) {
  const scene = recording.scene;
  const rows = scene.tension.map((column, cable) => {
    const row = document.createElement("div");
    const label = document.createElement("span");
    label.textContent = `Cable ${cable + 1}`;
    const value = document.createElement("b");
    value.textContent = `${significant(series(column)[place])} N`;
    const measured = document.createElement("span");
    const seen = scene.measuredTension ? series(scene.measuredTension[cable])[place] : null;
    measured.textContent = seen === null ? "not measured" : `measured ${significant(seen)} N`;
    row.append(label, value, measured);
    return row;
  });
  document.getElementById("tensions").replaceChildren(...rows);
}

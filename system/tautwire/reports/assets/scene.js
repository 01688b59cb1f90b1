// The robot in space: cables, paths and a slider that moves the platform.

const sceneFigure = document.getElementById("scene");
const views = {
  perspective: { eye: { x: 1.2, y: -1.4, z: 0.55 }, center: { x: 0, y: 0, z: -0.13 }, up: { x: 0, y: 0, z: 1 } },
  top: { eye: { x: 0, y: 0, z: 2.2 }, up: { x: 0, y: 1, z: 0 } },
  front: { eye: { x: 0, y: -2.2, z: 0 }, up: { x: 0, y: 0, z: 1 } },
  side: { eye: { x: 2.2, y: 0, z: 0 }, up: { x: 0, y: 0, z: 1 } },
};

const axisNames = ["x", "y", "z"];

/** The least and the largest coordinate along each axis of points that come as three columns each. */
function spansOf(points) {
  return axisNames.map((_, k) => {
    const values = points.flatMap((columns) => columns[k]).filter((value) => value !== null);
    return [Math.min(...values), Math.max(...values)];
  });
}

const exitPoints = () => axisNames.map((_, k) => report.anchors.map((anchor) => anchor[k]));

/** The view that faces a planar robot, whose exit points and platform stay in a plane across an axis; else undefined. */
function facing(scene) {
  const spans = spansOf([exitPoints(), scene.platform.map(series)]);
  const extents = spans.map(([low, high]) => high - low);
  const least = Math.min(...extents);
  return least <= 0.02 * Math.max(...extents) ? ["side", "front", "top"][extents.indexOf(least)] : undefined;
}

/** What fits the axes and the camera to the plane of a planar robot: nothing is drawn of the axis across it. */
function planeLayout(view, scene, times) {
  const paths = scene.paths.map((path) => magnified(path.columns, scene.platform, times));
  const spans = spansOf([exitPoints(), scene.platform.map(series), ...paths]);
  const size = Math.max(...spans.map(([low, high]) => high - low)) || 1;
  const ranges = spans.map(([low, high]) => [low - 0.06 * size, high + 0.06 * size]);
  const ratios = ranges.map(([low, high]) => (high - low) / size);
  const [right, up, across] = { side: [1, 2, 0], front: [0, 2, 1], top: [0, 1, 2] }[view];
  const { clientWidth, clientHeight } = sceneFigure;
  // The camera sees a height of 0.83 at a distance of 1; the titles of the axes need a quarter more.
  const height = Math.max(ratios[up], (0.9 * ratios[right] * clientHeight) / Math.max(1, clientWidth));
  const away = (1.25 * height) / 0.83 + 0.5 * ratios[across];
  const eye = Object.fromEntries(axisNames.map((name) => [name, Math.sign(views[view].eye[name]) * away]));
  const center = { x: 0, y: 0, z: 0, [axisNames[up]]: -0.03 * height };
  // From a little above, so that the axis to the right stands below the robot.
  eye[axisNames[up]] = 0.03 * away;
  const axes = axisNames.map((name, k) => [`${name}axis`, { range: ranges[k], visible: k !== across, tickangle: 0 }]);
  return {
    axes: Object.fromEntries(axes), camera: { eye, center, up: views[view].up },
    aspectratio: Object.fromEntries(axisNames.map((name, k) => [name, ratios[k]])),
  };
}

/** A view from far enough away that all fits into a narrow figure too, with the axes' titles. */
function camera(name) {
  const face = facing(chosen().scene);
  if (face) return planeLayout(face, chosen().scene, state.times).camera;
  const { clientWidth, clientHeight } = sceneFigure;
  const further = Math.max(1, 1.9 * clientHeight / Math.max(1, clientWidth));
  const { x, y, z } = views[name].eye;
  return { center: { x: 0, y: 0, z: 0 }, ...views[name], eye: { x: further * x, y: further * y, z: further * z } };
}

/** A view from near the platform, where deviations that are drawn larger can be seen. */
function closeUp(scene) {
  const { aspectratio, ...axes } = sceneFigure._fullLayout.scene;
  const sizes = [], center = {};
  ["x", "y", "z"].forEach((name, k) => {
    const [low, high] = axes[`${name}axis`].range;
    const scale = aspectratio[name] / (high - low);
    const columns = [scene.platform, ...(scene.paths.map((path) => path.columns))].map((path) => series(path[k]));
    const values = columns.flat().filter((value) => value !== null);
    const [first, last] = [Math.min(...values), Math.max(...values)];
    sizes.push(scale * (last - first));
    center[name] = scale * (0.5 * (first + last) - 0.5 * (low + high));
  });
  const away = Math.max(0.25, 1.1 * Math.max(...sizes));
  const face = views[facing(scene)];
  if (face) {
    const eye = Object.fromEntries(axisNames.map((name) => [name, center[name] + 1.3 * away * Math.sign(face.eye[name])]));
    return { center, eye, up: face.up };
  }
  const eye = { x: center.x + 0.62 * away, y: center.y - 0.72 * away, z: center.z + 0.3 * away };
  return { center, eye, up: views.perspective.up };
}

/** A path with its distance from the platform's drawn ``times`` larger. */
function magnified(path, reference, times) {
  return path.map((column, k) => series(column).map((value, i) => {
    const base = series(reference[k])[i];
    return value === null || base === null ? null : base + times * (value - base);
  }));
}

function positionAt(scene, place) {
  return scene.platform.map((column) => series(column)[place]);
}

/** Where a cable holds the platform: a point mass itself, or one of the body's attachments. */
function attachmentAt(scene, cable, place) {
  return scene.attachments ? scene.attachments[cable].map((column) => series(column)[place]) : positionAt(scene, place);
}

/** Lines from every anchor to the platform, a gap after each, and the tension along each. */
function cableLines(scene, place) {
  const lines = { x: [], y: [], z: [], tension: [] };
  report.anchors.forEach((anchor, cable) => {
    const end = attachmentAt(scene, cable, place);
    const tension = series(scene.tension[cable])[place];
    ["x", "y", "z"].forEach((name, k) => lines[name].push(anchor[k], end[k], null));
    lines.tension.push(tension, tension, tension);
  });
  return lines;
}

/** Edges of the hull of a body's attachments, a gap after each; nothing of a point mass. */
function bodyLines(scene, place) {
  const lines = { x: [], y: [], z: [] };
  scene.edges.forEach((edge) => {
    const [first, second] = edge.map((cable) => attachmentAt(scene, cable, place));
    axisNames.forEach((name, k) => lines[name].push(first[k], second[k], null));
  });
  return lines;
}

function pathTrace(path, scene, times, colour) {
  const columns = magnified(path.columns, scene.platform, times);
  return {
    type: "scatter3d", mode: "lines", name: path.name, x: columns[0], y: columns[1], z: columns[2], hoverinfo: "name",
    line: { color: colour[path.colour], width: path.width, dash: path.dash }, connectgaps: false,
  };
}

const hasTension = (scene) => scene.tension.some((column) => series(column).some((value) => value !== null));

function cableTrace(scene, place, colour) {
  const lines = cableLines(scene, place);
  let [low, high] = scene.tensionRange;
  if (!(high > low)) high = low + 1;
  return {
    type: "scatter3d", mode: "lines", name: "cables", x: lines.x, y: lines.y, z: lines.z, hoverinfo: "skip",
    connectgaps: false,
    line: !hasTension(scene) ? { width: 8, color: colour.muted } : {
      width: 8, color: lines.tension, cmin: low, cmax: high, showscale: true,
      colorscale: [[0, colour.low], [0.5, colour.middle], [1, colour.high]],
      colorbar: {
        orientation: "h", thickness: 10, len: 0.5, x: 0.5, y: 0, yanchor: "bottom", outlinewidth: 0, nticks: 5,
        title: { text: scene.tensionTitle, side: "top", font: { size: 12 } },
        tickfont: { color: colour.muted, size: 11 },
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
  const body = {
    type: "scatter3d", mode: "lines", name: "platform", ...bodyLines(scene, place), hoverinfo: "skip",
    connectgaps: false, line: { width: 5, color: colour.accent },
  };
  return [anchors, platform, ...(scene.edges.length ? [body] : [])];
}

function sceneLayout(colour, scene, times) {
  const face = facing(scene);
  const plane = face ? planeLayout(face, scene, times) : { axes: {} };
  const spatial = (name) => ({
    title: { text: `${name} (m)` }, color: colour.muted, gridcolor: colour["strong-rule"],
    zerolinecolor: colour["strong-rule"], showbackground: false, nticks: 6, showspikes: false,
    ...plane.axes[`${name}axis`],
  });
  return layout(colour, {
    margin: { l: 0, r: 0, t: 0, b: 0 }, hovermode: "closest",
    scene: {
      xaxis: spatial("x"), yaxis: spatial("y"), zaxis: spatial("z"),
      ...(face ? { aspectmode: "manual", aspectratio: plane.aspectratio } : { aspectmode: "data" }),
      camera: camera("perspective"), dragmode: face ? "pan" : "turntable", uirevision: `kept ${face}`, domain: { x: [0, 1], y: [face ? 0.17 : 0.1, 1] },
    },
  });
}

function drawScene(choice, place, times, view) {
  const colour = colours();
  const scene = choice.scene;
  const paths = scene.paths.map((path) => pathTrace(path, scene, times, colour));
  const traces = [cableTrace(scene, place, colour), ...pointTraces(scene, place, colour), ...paths];
  if (!has3d) return drawFlat(traces, view, colour);
  const drawn = Plotly.react(sceneFigure, traces, sceneLayout(colour, scene, times), config);
  drawn.then(fitPaper);
  return drawn;
}

/** Move what the slider moves: the cables, the first trace, and the platform, the third and, of a body, the fourth. */
function moveRobot(choice, place, times, view) {
  if (!has3d) return drawScene(choice, place, times, view);
  const lines = cableLines(choice.scene, place);
  const [x, y, z] = positionAt(choice.scene, place).map((value) => [value]);
  const edges = choice.scene.edges.length ? [bodyLines(choice.scene, place)] : [];
  return Plotly.restyle(sceneFigure, {
    x: [lines.x, x, ...edges.map((body) => body.x)],
    y: [lines.y, y, ...edges.map((body) => body.y)],
    z: [lines.z, z, ...edges.map((body) => body.z)],
    ...(hasTension(choice.scene) ? { "line.color": [lines.tension, undefined, ...edges.map(() => undefined)] } : {}),
  }, [0, 2, ...edges.map(() => 3)]);
}

/** Tensions of all cables at one time, in words. */
function showTensions(choice, place) {
  const scene = choice.scene;
  const rows = scene.tension.map((column, cable) => {
    const row = document.createElement("div");
    const cells = [["span", `Cable ${cable + 1}`], ["b", `${significant(series(column)[place])} ${scene.tensionUnit}`]];
    if (scene.measuredTension) {
      const seen = series(scene.measuredTension[cable])[place];
      cells.push(["span", seen === null ? "not measured" : `measured ${significant(seen)} ${scene.tensionUnit}`]);
    }
    row.append(...cells.map(([kind, words]) => {
      const cell = document.createElement(kind);
      cell.textContent = words;
      return cell;
    }));
    return row;
  });
  document.getElementById("tensions").replaceChildren(...rows);
}

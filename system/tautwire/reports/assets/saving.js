// Saving a figure: as a picture, or as a table of the numbers that it draws.

const titleHeight = 32;

/** What a figure shows, with the chosen recording, mode or controller; a table does not depend on that. */
function figureTitle(figure) {
  const isTable = figure.classList.contains("saved-table");
  const chosenNow = isTable ? null : document.querySelector("input[name=choice]:checked + span");
  return [figure.dataset.title, chosenNow?.textContent].filter(Boolean).join(", ");
}

/** A column's header with its unit; "Time (s)" is split before ``more`` is added to it. */
function headed(title, more = "") {
  const [, words, unit] = /^(.*) \(([^()]*)\)$/.exec(title) ?? [null, title, null];
  return unit === null ? words + more : `${words}${more} (${unit})`;
}

/** Columns of the lines of a panel: x where it differs from that of the line before, then y. */
function panelColumns({ traces, layout: { xaxis, ...axes } }) {
  const columns = [];
  let x = null;
  for (const trace of traces) {
    const unit = axes[trace.yaxis === "y2" ? "yaxis2" : "yaxis"].title.text;
    if (trace.x !== x) columns.push([headed(xaxis.title.text, x ? `: ${trace.name}` : ""), trace.x]);
    x = trace.x;
    columns.push([["", "1"].includes(unit) ? trace.name : `${trace.name} (${unit.replace(/^.* \((.*)\)$/, "$1")})`, trace.y]);
  }
  return columns;
}

/** Columns of the robot in motion: time or phase, positions, tensions. */
function sceneColumns(scene) {
  const axes = ["x", "y", "z"];
  const along = (name, columns) => columns.map((column, k) => [`${name} ${axes[k]} (m)`, series(column)]);
  const tensions = (name, columns) => columns.map((column, k) => [
    `${name}, cable ${k + 1} (${scene.tensionUnit})`, series(column),
  ]);
  return [
    [scene.clock === "s" ? "Time (s)" : `Phase (${scene.clock})`, series(scene.time)],
    ...along("platform", scene.platform), ...scene.paths.flatMap((path) => along(path.name, path.columns)),
    ...tensions("tension", scene.tension), ...tensions("measured tension", scene.measuredTension ?? []),
  ];
}

/** Columns of a table: its titles, in each row first a name, then numbers; a dash is absent. */
function tableColumns(table) {
  const number = (text) => (text === "–" ? null : Number(text.replace("−", "-")));
  const texts = [...table.tBodies[0].rows].map((row) => [...row.cells].map((cell) => cell.textContent.trim()));
  return [...table.tHead.rows[0].cells].map((title, place) => [
    title.textContent.trim(), texts.map((row) => (place === 0 ? row[place] : number(row[place]))),
  ]);
}

function columnsOf(figure) {
  if (figure.classList.contains("saved-table")) return tableColumns(figure.querySelector("table"));
  if (figure.classList.contains("scene")) return sceneColumns(chosen().scene);
  return panelOf(figure).columns ?? panelColumns(panelOf(figure));
}

/** Save a figure as it is drawn now, on a ground of its own and under its title. */
function savePicture(figure, filename, format) {
  const plot = figure.querySelector(".plot");
  const colour = colours();
  const text = figureTitle(figure).replace(/&/g, "&amp;").replace(/</g, "&lt;");
  const margin = { ...plot.layout.margin, t: plot.layout.margin.t + titleHeight };
  const title = { text, x: 0.02, y: 1, yref: "container", yanchor: "top", pad: { t: 10 }, font: { size: 14, color: colour.text } };
  const picture = { data: plot.data, layout: { ...plot.layout, title, margin, paper_bgcolor: colour.surface } };
  const size = { width: plot.clientWidth, height: plot.clientHeight + titleHeight, scale: 2 };
  return Plotly.downloadImage(picture, { format, filename, ...size });
}

function save(figure, format) {
  if (stale.has(figure)) drawFigure(figure);
  const filename = slug(`${figure.dataset.kind ?? ""} ${figureTitle(figure)}`);
  if (format === "csv") download(new Blob([csvText(columnsOf(figure))], { type: "text/csv" }), `${filename}.csv`);
  else savePicture(figure, filename, format);
}

function startTools() {
  for (const button of document.querySelectorAll(".tools button")) {
    const figure = button.closest("figure, .saved-table");
    const { save: format } = button.dataset;
    button.addEventListener("click", () => (format ? save(figure, format) : resetZoom(figure)));
  }
}

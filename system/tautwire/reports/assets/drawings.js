"use strict";
// Figures that are drawn already: saving them, and zooming into them.

const pixelsPerPoint = 3, titleRoom = 28, leastDrag = 5;

const boxOf = (text) => text.split(/[ ,]+/).map(Number);

function element(name, attributes) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  return made;
}

/** A drawing as it is seen now, on a ground of its own and under its title; and its size in points. */
function savedDrawing(figure) {
  const svg = figure.querySelector("svg");
  const copy = svg.cloneNode(true);
  const [x, y, width, height] = boxOf(svg.getAttribute("viewBox"));
  const [, , wholeWidth, wholeHeight] = boxOf(svg.dataset.whole);
  // All is as large as without a zoom.
  const scale = width / wholeWidth, top = y - scale * titleRoom;
  const style = getComputedStyle(document.documentElement);
  const [ink, ground] = ["--text", "--surface"].map((name) => style.getPropertyValue(name).trim());
  // What a zoom cuts off must not lie behind the title.
  const room = element("rect", { x, y: top, width, height: scale * titleRoom, fill: ground });
  const letter = scale * Math.min(11, (1.6 * wholeWidth) / figure.dataset.title.length);
  const place = { x: x + 8 * scale, y: y - 10 * scale, fill: ink };
  const title = element("text", { ...place, "font-size": letter, "font-family": "sans-serif" });
  title.textContent = figure.dataset.title;
  copy.prepend(element("rect", { x, y, width, height, fill: ground }));
  copy.append(room, title);
  const size = [wholeWidth, wholeHeight + titleRoom];
  const viewBox = [x, top, width, height + scale * titleRoom].join(" ");
  const attributes = { viewBox, width: size[0], height: size[1], style: `color: ${ink}` };
  for (const [key, value] of Object.entries(attributes)) copy.setAttribute(key, String(value));
  copy.removeAttribute("aria-hidden");
  return { blob: new Blob([new XMLSerializer().serializeToString(copy)], { type: "image/svg+xml" }), size };
}

async function saveDrawing(figure, format) {
  const filename = `${slug(`${figure.id} ${figure.dataset.title}`)}.${format}`;
  const { blob, size } = savedDrawing(figure);
  if (format === "svg") return download(blob, filename);
  const picture = new Image();
  picture.src = URL.createObjectURL(blob);
  await picture.decode();
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = size.map((each) => Math.round(pixelsPerPoint * each));
  canvas.getContext("2d").drawImage(picture, 0, 0, canvas.width, canvas.height);
  URL.revokeObjectURL(picture.src);
  return canvas.toBlob((content) => download(content, filename));
}

/** The rectangle between two points, grown about its middle to the shape of the whole drawing. */
function zoomedBox(one, other, [, , width, height]) {
  const share = Math.max(Math.abs(other.x - one.x) / width, Math.abs(other.y - one.y) / height);
  const [middleX, middleY] = [0.5 * (one.x + other.x), 0.5 * (one.y + other.y)];
  return [middleX - 0.5 * share * width, middleY - 0.5 * share * height, share * width, share * height];
}

/** Zoom where the mouse is dragged; a finger scrolls the page. */
function followMouse(svg) {
  svg.dataset.whole = svg.getAttribute("viewBox");
  const whole = boxOf(svg.dataset.whole);
  const point = ({ clientX, clientY }) => new DOMPoint(clientX, clientY).matrixTransform(svg.getScreenCTM().inverse());
  const frame = element("rect", { class: "drag-frame" });
  let start = null;
  svg.addEventListener("pointerdown", (event) => {
    if (event.pointerType !== "mouse" || event.button !== 0) return;
    event.preventDefault();
    svg.setPointerCapture(event.pointerId);
    start = { at: point(event), event };
  });
  svg.addEventListener("pointermove", (event) => {
    if (!start) return;
    const [a, b] = [start.at, point(event)];
    const sides = { x: Math.min(a.x, b.x), y: Math.min(a.y, b.y), width: Math.abs(b.x - a.x), height: Math.abs(b.y - a.y) };
    for (const [key, value] of Object.entries(sides)) frame.setAttribute(key, String(value));
    svg.append(frame);
  });
  svg.addEventListener("pointerup", (event) => {
    if (!start) return;
    const { at, event: begun } = start;
    start = null;
    frame.remove();
    const dragged = Math.hypot(event.clientX - begun.clientX, event.clientY - begun.clientY);
    if (dragged >= leastDrag) svg.setAttribute("viewBox", zoomedBox(at, point(event), whole).join(" "));
  });
  svg.addEventListener("pointercancel", () => {
    start = null;
    frame.remove();
  });
  const reset = () => svg.setAttribute("viewBox", whole.join(" "));
  svg.addEventListener("dblclick", reset);
  return reset;
}

for (const figure of document.querySelectorAll("figure.drawn")) {
  const reset = followMouse(figure.querySelector("svg"));
  for (const button of figure.querySelectorAll(".tools button")) {
    const { save } = button.dataset;
    button.addEventListener("click", () => (save ? saveDrawing(figure, save) : reset()));
  }
}

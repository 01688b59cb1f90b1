"use strict";
// Data, colours and the layout that all figures share.

const report = JSON.parse(document.getElementById("report-data").textContent);

/** What each kind of panel draws of a choice: (choice, place of the channel, scale) => what drawPanel takes. */
const panelKinds = {};

/** Numbers from base64 of little-endian float32; NaN is a gap. */
function unpack(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return Array.from({ length: bytes.length / 4 }, (_, place) => {
    const value = view.getFloat32(4 * place, true);
    return Number.isNaN(value) ? null : value;
  });
}

const unpacked = new Map();

/** The same, unpacked once. */
function series(text) {
  if (!unpacked.has(text)) unpacked.set(text, unpack(text));
  return unpacked.get(text);
}

/** The page's colours as they are now, light or dark. */
function colours() {
  const style = getComputedStyle(document.documentElement);
  const names = ["page", "surface", "text", "muted", "rule", "strong-rule", "accent", "before", "measured", "band",
    "band-fill", "grid", "low", "middle", "high", "mode", "mode-band", "warn", "warn-band"];
  return Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

const fontFamily = getComputedStyle(document.body).fontFamily;
const isTouch = window.matchMedia("(pointer: coarse)").matches;

function axis(colour, title, more) {
  return {
    title: { text: title, standoff: 6, font: { size: 12 } }, color: colour.muted, gridcolor: colour.grid,
    linecolor: colour["strong-rule"], zeroline: false, ticks: "", nticks: 6, automargin: true,
    exponentformat: "power", minexponent: 6,
    // Dragging would keep a finger from scrolling the page.
    fixedrange: isTouch, ...more,
  };
}

function layout(colour, more) {
  return {
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", showlegend: false, hovermode: "x unified",
    font: { family: fontFamily, size: 12, color: colour.muted }, margin: { l: 8, r: 8, t: 4, b: 8 },
    dragmode: isTouch ? false : "zoom",
    hoverlabel: { bgcolor: colour.surface, bordercolor: colour["strong-rule"], font: { color: colour.text } },
    ...more,
  };
}

const config = { displayModeBar: false, responsive: true, showTips: false, doubleClick: false };

/** Let the style sheet shrink a drawn figure to the width of paper: a drawing without a view box would be cut. */
function fitPaper(plot) {
  const { width, height } = plot._fullLayout;
  plot.style.setProperty("--shape", `${width} / ${height}`);
  for (const drawing of plot.querySelectorAll(".main-svg")) drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
}

/** A number with three significant digits, with four where these are whole, as the tables write it. */
function significant(value) {
  if (value === null || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e6)) return value.toExponential(2);
  const decimals = size === 0 ? 0 : Math.max(0, 2 - Math.floor(Math.log10(size)));
  return Number(value.toPrecision(4)).toFixed(decimals).replace("-", "−");
}

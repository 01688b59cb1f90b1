// Controls, and drawing of what comes into view.

const state = { choice: 0, place: 0, times: 1, view: "perspective", scale: "all", span: null, timer: 0 };
const slider = document.getElementById("time");
const chosen = () => report.choices[state.choice];
const stale = new Set();

/** Draw a figure now: a panel or the scene. */
function drawFigure(figure) {
  stale.delete(figure);
  if (figure.classList.contains("scene")) drawScene(chosen(), state.place, state.times, state.view);
  else drawPanel(figure);
  document.documentElement.dataset.drawn = String(document.querySelectorAll(".js-plotly-plot").length);
}

const inView = new Set();
const watcher = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    if (isIntersecting) inView.add(target);
    else inView.delete(target);
    if (isIntersecting && stale.has(target)) drawFigure(target);
  }
}, { rootMargin: "600px 0px" });

/** Draw figures again but for one: those in view at once, the others when they come into view. */
function redraw(selector, except = null) {
  for (const figure of document.querySelectorAll(selector)) {
    if (figure === except) continue;
    stale.add(figure);
    if (inView.has(figure)) drawFigure(figure);
  }
}

/** Draw all that is not drawn yet, and open what is folded until the page has been printed. */
function preparePrint() {
  [...stale].forEach(drawFigure);
  document.querySelectorAll(".js-plotly-plot").forEach(fitPaper);
  for (const folded of document.querySelectorAll("details:not([open])")) {
    folded.open = true;
    folded.dataset.openedToPrint = "";
  }
  if (sceneFigure && has3d) showPicture(sceneFigure);
}

/** Fold again what was opened to be printed. */
function finishPrint() {
  for (const opened of document.querySelectorAll("details[data-opened-to-print]")) {
    opened.open = false;
    delete opened.dataset.openedToPrint;
  }
}

/** Lay a picture over a scene in 3D, whose own drawing area browsers leave blank on paper. */
function showPicture(plot) {
  plot.querySelector(".on-paper")?.remove();
  const picture = new Image();
  picture.className = "on-paper";
  picture.alt = "";
  picture.src = plot._fullLayout.scene._scene.toImage("png");
  plot.querySelector(".gl-container").append(picture);
}

function showTime() {
  const { scene } = chosen();
  const words = `${series(scene.time)[state.place].toFixed(scene.decimals)} ${scene.clock}`;
  document.getElementById("time-shown").textContent = words;
  slider.value = String(state.place);
  slider.setAttribute("aria-valuetext", words);
  showTensions(chosen(), state.place);
}

function goTo(place) {
  state.place = place;
  showTime();
  if (sceneFigure.classList.contains("js-plotly-plot")) moveRobot(chosen(), place, state.times, state.view);
}

function turn(view) {
  state.view = view;
  if (!has3d) redraw("figure.scene");
  else Plotly.relayout(sceneFigure, { "scene.camera": view === "close" ? closeUp(chosen().scene) : camera(view) });
}

function stop() {
  cancelAnimationFrame(state.timer);
  state.timer = 0;
  const button = document.getElementById("play");
  button.textContent = "Play";
  button.setAttribute("aria-pressed", "false");
}

/** Play at the scene's pace, from the start again where it had ended; a cycle goes round. */
function play() {
  const { time, pace, cycle } = chosen().scene;
  const times = series(time);
  const last = times.length - 1;
  if (state.place >= last) state.place = 0;
  const button = document.getElementById("play");
  button.textContent = "Pause";
  button.setAttribute("aria-pressed", "true");
  let began = performance.now() - 1000 * pace * (times[state.place] - times[0]);
  const frame = (now) => {
    let passed = times[0] + (now - began) / (1000 * pace);
    let place = state.place;
    if (cycle && passed >= times[last]) {
      began = now;
      [passed, place] = [times[0], 0];
    }
    while (place < last && times[place + 1] <= passed) place += 1;
    if (place !== state.place) goTo(place);
    if (place >= last && !cycle) stop();
    else state.timer = requestAnimationFrame(frame);
  };
  state.timer = requestAnimationFrame(frame);
}

/** Offer the views that differ: a planar robot is seen from the front alone. */
function showViews() {
  const isPlanar = Boolean(facing(chosen().scene));
  for (const button of document.querySelectorAll("[data-view]")) {
    button.hidden = isPlanar && ["top", "front", "side"].includes(button.dataset.view);
    if (button.dataset.view === "perspective") button.textContent = isPlanar ? "Whole" : "Perspective";
  }
}

function choose(index) {
  stop();
  state.choice = index;
  state.span = null;
  state.place = 0;
  state.times = chosen().scene.magnify;
  const magnify = document.getElementById("magnify");
  if (magnify) magnify.value = String(state.times);
  slider.max = String(series(chosen().scene.time).length - 1);
  showTime();
  showViews();
  redraw("figure");
}

function fillMagnify() {
  const select = document.getElementById("magnify");
  if (!select) return;
  select.replaceChildren(...report.magnifications.map((times) => {
    const label = times === 1 ? "to scale" : `${times} times larger`;
    return new Option(label, String(times));
  }));
  select.addEventListener("change", () => {
    state.times = Number(select.value);
    redraw("figure.scene");
  });
}

/** Call back when a radio button of a group is chosen; gives the value chosen now, which browsers may restore. */
function radio(name, chose) {
  const inputs = [...document.querySelectorAll(`input[name=${name}]`)];
  for (const input of inputs) input.addEventListener("change", () => chose(input.value));
  const checked = inputs.find((input) => input.checked);
  return checked ? checked.value : null;
}

function start() {
  if (!has3d) document.getElementById("flat").hidden = false;
  fillMagnify();
  for (const figure of document.querySelectorAll("figure")) watcher.observe(figure);
  for (const button of document.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => turn(button.dataset.view));
  }
  slider.addEventListener("input", () => {
    stop();
    goTo(Number(slider.value));
  });
  document.getElementById("play").addEventListener("click", () => (state.timer ? stop() : play()));
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraw("figure"));
  window.addEventListener("beforeprint", preparePrint);
  window.addEventListener("afterprint", finishPrint);
  state.scale = radio("scale", (value) => {
    state.scale = value;
    redraw("figure[data-kind=residual]");
  });
  choose(Number(radio("choice", (value) => choose(Number(value)))));
}

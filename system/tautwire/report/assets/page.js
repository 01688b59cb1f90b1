// Controls, and drawing of what comes into view.

const state = { recording: 0, place: 0, times: 1, scale: "all", timer: 0 };
const slider = document.getElementById("time");
const chosen = () => report.recordings[state.recording];
const stale = new Set();

/** Draw a figure now: a panel or the scene. */
function drawFigure(figure) {
  stale.delete(figure);
  if (figure.classList.contains("scene")) drawScene(chosen(), state.place, state.times);
  else drawPanel(figure, chosen(), state.scale);
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

/** Draw figures again: those in view at once, the others when they come into view. */
function redraw(selector) {
  for (const figure of document.querySelectorAll(selector)) {
    stale.add(figure);
    if (inView.has(figure)) drawFigure(figure);
  }
}

function showTime() {
  const time = series(chosen().scene.time)[state.place];
  const words = `${time.toFixed(2)} s`;
  document.getElementById("time-shown").textContent = words;
  slider.value = String(state.place);
  slider.setAttribute("aria-valuetext", words);
  showTensions(chosen(), state.place);
}

function goTo(place) {
  state.place = place;
  showTime();
  if (document.getElementById("scene").classList.contains("js-plotly-plot")) moveRobot(chosen(), place);
}

function stop() {
  cancelAnimationFrame(state.timer);
  state.timer = 0;
  const button = document.getElementById("play");
  button.textContent = "Play";
  button.setAttribute("aria-pressed", "false");
}

/** Play at the recording's own pace, from the start again where it had ended. */
function play() {
  const times = series(chosen().scene.time);
  if (state.place >= times.length - 1) state.place = 0;
  const button = document.getElementById("play");
  button.textContent = "Pause";
  button.setAttribute("aria-pressed", "true");
  const began = performance.now() - 1000 * (times[state.place] - times[0]);
  const frame = (now) => {
    const passed = times[0] + (now - began) / 1000;
    let place = state.place;
    while (place < times.length - 1 && times[place + 1] <= passed) place += 1;
    if (place !== state.place) goTo(place);
    if (place >= times.length - 1) stop();
    else state.timer = requestAnimationFrame(frame);
  };
  state.timer = requestAnimationFrame(frame);
}

function chooseRecording(index) {
  stop();
  state.recording = index;
  state.place = 0;
  state.times = chosen().scene.magnify;
  document.getElementById("magnify").value = String(state.times);
  slider.max = String(series(chosen().scene.time).length - 1);
  showTime();
  redraw("figure");
}

function fillMagnify() {
  const select = document.getElementById("magnify");
  select.replaceChildren(...report.magnifications.map((times) => {
    const label = times === 1 ? "to scale" : `${times} times larger`;
    return new Option(label, String(times));
  }));
  select.addEventListener("change", () => {
    state.times = Number(select.value);
    redraw("figure.scene");
  });
}

function start() {
  fillMagnify();
  for (const figure of document.querySelectorAll("figure")) watcher.observe(figure);
  for (const input of document.querySelectorAll("input[name=recording]")) {
    input.addEventListener("change", () => chooseRecording(Number(input.value)));
  }
  for (const input of document.querySelectorAll("input[name=scale]")) {
    input.addEventListener("change", () => {
      state.scale = input.value;
      redraw("figure[data-kind=residual]");
    });
  }
  for (const button of document.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => {
      Plotly.relayout(document.getElementById("scene"), { "scene.camera": camera(button.dataset.view) });
    });
  }
  slider.addEventListener("input", () => {
    stop();
    goTo(Number(slider.value));
  });
  document.getElementById("play").addEventListener("click", () => (state.timer ? stop() : play()));
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraw("figure"));
  window.addEventListener("beforeprint", () => [...stale].forEach(drawFigure));
  // Browsers restore a chosen radio button when a page is loaded again.
  const checked = document.querySelector("input[name=recording]:checked");
  state.scale = document.querySelector("input[name=scale]:checked").value;
  chooseRecording(checked ? Number(checked.value) : 0);
}

if (report.recordings.length > 0) start();

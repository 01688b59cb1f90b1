// Last, when all kinds of panels are known: inflate plotly, then draw.

/** Run the plotly.js that the page holds as base64 of gzip; as a script of its own, since it defines a global. */
async function loadPlotly() {
  const packed = atob(document.getElementById("packed-plotly").textContent);
  const bytes = Uint8Array.from(packed, (letter) => letter.charCodeAt(0));
  const inflated = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const script = document.createElement("script");
  script.textContent = await new Response(inflated).text();
  document.head.append(script);
}

async function startPage() {
  if (typeof DecompressionStream === "undefined") {
    document.getElementById("old-browser").hidden = false;
    return;
  }
  await loadPlotly();
  startTools();
  if (!sceneFigure) startCampaign();
  else if (report.choices.length > 0) start();
  document.documentElement.dataset.started = "";
}

startPage();

#include "evaluation/report_page.h"

namespace dlsd {

const std::string_view kReportStyle = R"css(
:root { color-scheme: light dark; --bg: #f6f6f5; --card: #fff; --text: #222; --dim: #6a6a68; --line: #dcdcd8; --accent: #0b63b5; }
@media (prefers-color-scheme: dark) {
  :root { --bg: #1a1b1c; --card: #242627; --text: #e6e6e3; --dim: #a0a09c; --line: #3a3c3d; --accent: #7db9f2; }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--bg); color: var(--text); font: 15px/1.45 system-ui, sans-serif; }
main { max-width: 1440px; margin: 0 auto; padding: 24px; }
h1 { font-size: 24px; margin: 0 0 4px; }
h2 { font-size: 17px; margin: 32px 0 10px; }
p { margin: 4px 0 0; color: var(--dim); }
.scroll { overflow-x: auto; background: var(--card); border: 1px solid var(--line); border-radius: 8px; margin-top: 10px; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { padding: 7px 10px; text-align: right; white-space: nowrap; border-bottom: 1px solid var(--line); }
th:first-child, td:first-child { text-align: left; }
tbody tr:last-child > * { border-bottom: 0; }
thead th { font-weight: 600; color: var(--dim); font-size: 13px; }
thead .group { text-align: center; border-left: 1px solid var(--line); }
tr.all td { font-weight: 600; border-top: 2px solid var(--line); }
small { color: var(--dim); font-size: 12px; margin-left: 5px; }
dl { display: flex; flex-wrap: wrap; gap: 10px; margin: 10px 0 0; }
dl div { background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: 10px 16px; }
dt { color: var(--dim); font-size: 13px; }
dd { margin: 0; font-size: 20px; font-variant-numeric: tabular-nums; }
.gallery { display: grid; grid-template-columns: repeat(auto-fill, minmax(230px, 1fr)); gap: 14px; }
.gallery a { display: block; background: var(--card); border: 1px solid var(--line); border-radius: 8px; overflow: hidden; color: inherit; text-decoration: none; }
.gallery a:hover, .gallery a:focus-visible { border-color: var(--accent); outline: 1px solid var(--accent); }
.gallery img { display: block; width: 100%; height: auto; background: #000; }
.gallery span { display: flex; justify-content: space-between; gap: 8px; padding: 7px 11px; font-size: 13px; color: var(--dim); }
.gallery b { color: var(--text); font-weight: 600; }
#viewer { position: fixed; inset: 0; display: none; flex-direction: column; background: var(--bg); }
#viewer.open { display: flex; }
#viewer header { display: flex; flex-wrap: wrap; align-items: center; gap: 6px 18px; padding: 8px 16px; border-bottom: 1px solid var(--line); background: var(--card); font-size: 14px; }
#viewer header label { display: inline-flex; align-items: center; gap: 6px; cursor: pointer; }
#viewer header label[hidden] { display: none; }
#viewer button, #viewer select { font: inherit; color: inherit; background: var(--bg); border: 1px solid var(--line); border-radius: 6px; padding: 3px 11px; cursor: pointer; }
#viewer .filters { display: inline-flex; flex-wrap: wrap; align-items: center; gap: 6px 14px; }
#viewer .filters input { width: 4.6em; font: inherit; color: inherit; background: var(--bg); border: 1px solid var(--line); border-radius: 6px; padding: 2px 5px; }
#viewer .title { font-weight: 600; }
#viewer .title small { font-weight: 400; }
#viewer .right { margin-left: auto; display: flex; gap: 8px; align-items: center; }
#stage { flex: 1; min-height: 0; position: relative; background: #101112; touch-action: none; cursor: grab; }
#stage.drag { cursor: grabbing; }
#stage svg { position: absolute; inset: 0; width: 100%; height: 100%; }
#stage image { image-rendering: pixelated; }
#stage .failed { position: absolute; inset: 0; display: grid; place-items: center; color: #ddd; }
polyline { fill: none; vector-effect: non-scaling-stroke; stroke-linecap: round; stroke-linejoin: round; stroke-width: 1.6; }
polyline:hover { stroke-width: 4; }
footer { display: flex; flex-wrap: wrap; gap: 4px 16px; padding: 6px 16px; border-top: 1px solid var(--line); background: var(--card); font-size: 13px; color: var(--dim); }
footer i { display: inline-block; width: 18px; height: 3px; border-radius: 2px; vertical-align: middle; margin-right: 6px; }
.crease { stroke: #4aa8ff; } .silhouette { stroke: #ffb02e; } .material { stroke: #35d07f; } .wire { stroke: #c48bff; } .shadow { stroke: #a9b4bd; }
.right-line { stroke: #22d3ee; } .merged-line { stroke: #fb923c; } .false-alarm { stroke: #facc15; }
.miss { stroke: #ff4d6d; } .miss.other { stroke-opacity: .6; stroke-dasharray: 5 4; }
)css";

const std::string_view kReportViewer = R"html(
<div id="viewer" role="dialog" aria-modal="true" aria-label="Frame">
<header>
<span class="title" id="title"></span>
<label><input type="checkbox" id="show-labels">labels</label>
<label class="needs-detections"><input type="checkbox" id="show-detections" checked>detections</label>
<label class="needs-detections"><input type="checkbox" id="show-misses" checked>misses</label>
<label class="needs-detections"><input type="checkbox" id="show-false-alarms" checked>false alarms</label>
<label class="needs-detections">&rho; <select id="rho"></select></label>
<span class="filters" role="group" aria-label="Filters">
<label title="Labels of less contrast are hidden; detections have none">contrast &ge; <input type="number" id="min-contrast" min="0" max="255" value="0"></label>
<label title="Shorter curves are hidden">length &ge; <input type="number" id="min-length" min="0" value="0"> px</label>
<label title="Angle to the optical axis at the middle of the curve">field angle <input type="number" id="min-field" min="0" max="180" value="0"> to <input type="number" id="max-field" min="0" max="180" value="180">&deg;</label>
<button id="no-filters" title="All curves">Reset</button>
</span>
<span class="right"><button id="previous" title="Left arrow">&larr;</button><button id="next" title="Right arrow">&rarr;</button><button id="fit" title="Double click">Fit</button><button id="close" title="Escape">Close</button></span>
</header>
<div id="stage"></div>
<footer id="legend"></footer>
</div>
)html";

const std::string_view kReportScript = R"js(
"use strict";
// `report` (frames, rho, hasDetections) is written before this script. A frame's curves come with
// frames/NNNNNN.js, which calls dlsdFrame: a script may be loaded from disk where fetch may not.
const byId = id => document.getElementById(id);
const viewer = byId("viewer"), stage = byId("stage");
const loaded = new Map();
let current = -1, view = null, scrolled = 0;

function svg(name, attributes, parent) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const key in attributes) element.setAttribute(key, attributes[key]);
  if (parent) parent.appendChild(element);
  return element;
}
function polyline(points, cls, tip, parent) {
  const element = svg("polyline", {points, class: cls}, parent);
  svg("title", {}, element).textContent = tip;
}
window.dlsdFrame = frame => { loaded.set(frame.index, frame); if (frame.index === current) draw(); };

function draw() {
  const frame = loaded.get(current), bit = 1 << byId("rho").selectedIndex;
  stage.replaceChildren();
  if (!view || view.index !== current) view = {index: current, x: -0.5, y: -0.5, w: frame.width, h: frame.height};
  const root = svg("svg", {preserveAspectRatio: "xMidYMid meet"}, stage);
  setView(root);
  svg("image", {href: report.frames[current].image, x: -0.5, y: -0.5, width: frame.width, height: frame.height}, root);
  const count = {}, all = {};
  const limit = (id, otherwise) => byId(id).value === "" ? otherwise : Number(byId(id).value);
  const contrast = limit("min-contrast", 0), length = limit("min-length", 0);
  const nearest = limit("min-field", 0), farthest = limit("max-field", 180);
  const passes = l => !(l.contrast < contrast) && l.length >= length && (l.field === "" || (l.field >= nearest && l.field <= farthest));
  const add = (key, on, l, cls, tip) => {
    all[key] = (all[key] || 0) + 1;
    if (!passes(l)) return;
    count[key] = (count[key] || 0) + 1;
    if (on) polyline(l.points, cls, tip, root);
  };
  const on = name => byId("show-" + name).checked;
  for (const l of frame.labels) {
    const found = report.hasDetections ? (l.found & bit ? ", found" : ", missed") : "";
    add(l.kind, on("labels"), l, l.kind, `label ${l.id}: ${l.kind}, ${l.stratum}, ${l.length} px, ${l.angle} deg, contrast ${l.contrast}, field angle ${l.field} deg, ends ${l.ends}${found}`);
  }
  if (report.hasDetections) {
    for (const d of frame.detections) {
      const tip = `detection ${d.index}: ${d.coverage[byId("rho").selectedIndex]} % on its best carrier` + (d.score === undefined ? "" : `, score ${d.score}`);
      if (d.merged & bit) add("merged", on("detections"), d, "merged-line", tip + ", merged");
      else if (d.right & bit) add("right", on("detections"), d, "right-line", tip + ", right");
      else add("wrong", on("false-alarms"), d, "false-alarm", tip + ", wrong");
    }
    for (const l of frame.labels) {
      if (l.found & bit) continue;
      const headline = l.stratum === "headline";
      add(headline ? "missed" : "missed-other", on("misses"), l, headline ? "miss" : "miss other", `missed label ${l.id}: ${l.kind}, ${l.stratum}, ${l.length} px, ${l.angle} deg, contrast ${l.contrast}`);
    }
  }
  const legend = byId("legend");
  legend.replaceChildren();
  const entry = (shown, key, cls, text) => {
    if (!shown || !all[key]) return;
    const item = document.createElement("span"), swatch = document.createElement("i");
    const probe = svg("polyline", {class: cls}, root);
    swatch.style.background = getComputedStyle(probe).stroke;
    probe.remove();
    const passed = count[key] || 0;
    item.append(swatch, passed < all[key] ? `${text} ${passed} of ${all[key]}` : `${text} ${passed}`);
    legend.append(item);
  };
  for (const kind of ["crease", "silhouette", "material", "wire", "shadow"]) entry(on("labels"), kind, kind, kind);
  entry(on("detections"), "right", "right-line", "right");
  entry(on("detections"), "merged", "merged-line", "merged");
  entry(on("false-alarms"), "wrong", "false-alarm", "false alarms");
  entry(on("misses"), "missed", "miss", "missed (headline)");
  entry(on("misses"), "missed-other", "miss other", "missed (crowded, short, faint; dashed)");
  const hint = document.createElement("span");
  hint.textContent = "Wheel zooms, drag moves, a curve under the pointer tells what it is.";
  legend.append(hint);
}
function setView(root) { (root || stage.querySelector("svg")).setAttribute("viewBox", `${view.x} ${view.y} ${view.w} ${view.h}`); }

function open(index) {
  if (current < 0) scrolled = window.scrollY;
  current = index;
  const frame = report.frames[index];
  viewer.classList.add("open");
  document.body.style.overflow = "hidden";
  byId("title").replaceChildren(frame.name);
  const note = document.createElement("small");
  note.textContent = frame.camera;
  byId("title").append(note);
  if (loaded.has(index)) { draw(); return; }
  stage.replaceChildren();
  const script = document.createElement("script");
  script.src = frame.script;
  script.onerror = () => {
    const failed = document.createElement("div");
    failed.className = "failed";
    failed.textContent = `${frame.script} is missing beside this page.`;
    stage.replaceChildren(failed);
  };
  document.head.append(script);
}
function close() {
  current = -1;
  viewer.classList.remove("open");
  document.body.style.overflow = "";
  window.scrollTo(0, scrolled);
}
function route() {
  const match = /^#frame-(\d+)$/.exec(location.hash);
  if (match && Number(match[1]) < report.frames.length) open(Number(match[1]));
  else if (current >= 0) close();
}
const step = by => { location.hash = `#frame-${(current + by + report.frames.length) % report.frames.length}`; };

report.rho.forEach(rho => byId("rho").add(new Option(`${rho} px`)));
byId("rho").selectedIndex = report.rho.length - 1;
byId("show-labels").checked = !report.hasDetections;
document.querySelectorAll(".needs-detections").forEach(e => { e.hidden = !report.hasDetections; });
viewer.querySelectorAll("input, select").forEach(e => e.addEventListener("input", () => { if (loaded.has(current)) draw(); }));
byId("no-filters").onclick = () => {
  viewer.querySelectorAll(".filters input").forEach(e => { e.value = e.defaultValue; });
  if (loaded.has(current)) draw();
};
byId("previous").onclick = () => step(-1);
byId("next").onclick = () => step(1);
byId("close").onclick = () => { location.hash = ""; };
const fit = () => { view = null; if (loaded.has(current)) draw(); };
byId("fit").onclick = fit;
stage.ondblclick = fit;
addEventListener("hashchange", route);
addEventListener("keydown", event => {
  if (current < 0) return;
  if (event.key !== "Escape" && (event.target.tagName === "SELECT" || event.target.type === "number")) return;
  if (event.key === "Escape") location.hash = "";
  else if (event.key === "ArrowLeft") step(-1);
  else if (event.key === "ArrowRight") step(1);
});
const toImage = event => {
  const root = stage.querySelector("svg");
  if (!root || !view) return null;
  return new DOMPoint(event.clientX, event.clientY).matrixTransform(root.getScreenCTM().inverse());
};
stage.addEventListener("wheel", event => {
  event.preventDefault();
  const at = toImage(event);
  if (!at) return;
  const factor = Math.min(Math.max(Math.exp(event.deltaY * 0.0015), 8 / view.w), 4 * loaded.get(current).width / view.w);
  view.x = at.x - (at.x - view.x) * factor;
  view.y = at.y - (at.y - view.y) * factor;
  view.w *= factor;
  view.h *= factor;
  setView();
}, {passive: false});
let grabbed = null;
stage.addEventListener("pointerdown", event => { grabbed = toImage(event); stage.setPointerCapture(event.pointerId); stage.classList.add("drag"); });
stage.addEventListener("pointermove", event => {
  const at = grabbed && toImage(event);
  if (!at) return;
  view.x += grabbed.x - at.x;
  view.y += grabbed.y - at.y;
  setView();
});
for (const name of ["pointerup", "pointercancel"]) stage.addEventListener(name, () => { grabbed = null; stage.classList.remove("drag"); });
route();
)js";

}  // namespace dlsd

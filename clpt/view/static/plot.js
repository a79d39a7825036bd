// Plots of spectra: a mean with its error bars, or a curve whose points are dragged.

import { h, short } from "./dom.js";

const WIDTH = 300, HEIGHT = 150, LEFT = 6, RIGHT = 6, TOP = 14, BOTTOM = 22;
// How the eye sees the wavelengths, roughly: a strip below the axis, to find one's way.
const HUES = [
  [380, "#2a0038"], [420, "#4b1b9c"], [450, "#2f45d8"], [480, "#1488c8"], [500, "#12a378"], [530, "#2fb13a"],
  [560, "#8fb51f"], [580, "#d8ad1c"], [600, "#dd7d22"], [630, "#cf3a26"], [680, "#8d1a18"], [780, "#2a0606"],
];

function axes([low, high], top, label) {
  const x = (nm) => LEFT + ((nm - low) / (high - low)) * (WIDTH - LEFT - RIGHT);
  const y = (value) => HEIGHT - BOTTOM - (value / top) * (HEIGHT - TOP - BOTTOM);
  const id = `hues${low}-${high}`;
  const stops = HUES.map(([nm, colour]) => h("stop", { offset: Math.min(1, Math.max(0, (nm - low) / (high - low))), "stop-color": colour }));
  const svg = h("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "plot", role: "img", "aria-label": label },
    h("defs", {}, h("linearGradient", { id }, stops)),
    h("line", { x1: LEFT, x2: WIDTH - RIGHT, y1: y(0), y2: y(0), class: "axis" }),
    h("line", { x1: LEFT, x2: WIDTH - RIGHT, y1: y(top), y2: y(top), class: "grid" }),
    h("rect", { x: LEFT, y: y(0) + 2, width: WIDTH - LEFT - RIGHT, height: 3, fill: `url(#${id})` }),
    h("text", { x: LEFT, y: TOP - 4 }, short(top, 3)));
  for (let nm = Math.ceil(low / 100) * 100; nm <= high; nm += 100) {
    svg.append(h("line", { x1: x(nm), x2: x(nm), y1: y(0), y2: y(top), class: "grid" }));
    const last = nm + 100 > high;
    svg.append(h("text", { x: Math.min(x(nm), WIDTH - 18), y: HEIGHT - 5, "text-anchor": "middle" }, last ? `${nm} nm` : `${nm}`));
  }
  return { svg, x, y };
}

// lambdas, mean, error: of as many bands; other: a second mean to compare with.
export function spectrumPlot({ lambdas, mean, error }, other) {
  const step = lambdas.length > 1 ? lambdas[1] - lambdas[0] : 10;
  const range = [lambdas[0] - step / 2, lambdas.at(-1) + step / 2];
  const top = Math.max(1e-12, ...mean.map((m, i) => m + error[i]), ...(other?.mean ?? [])) * 1.02;
  const { svg, x, y } = axes(range, top, "the pixel's spectrum");
  if (other) svg.append(h("polyline", { class: "other", points: other.lambdas.map((nm, i) => `${x(nm)},${y(other.mean[i])}`).join(" ") }));
  const bars = mean.map((m, i) => {
    const [high, low] = [y(m + error[i]), y(Math.max(0, m - error[i]))];
    return `M${x(lambdas[i])} ${high}V${low}M${x(lambdas[i]) - 1.5} ${high}h3M${x(lambdas[i]) - 1.5} ${low}h3`;
  });
  svg.append(h("polyline", { class: "mean", points: mean.map((m, i) => `${x(lambdas[i])},${y(m)}`).join(" ") }));
  svg.append(h("path", { class: "bars", d: bars.join("") }));
  return svg;
}

// points: [[nm, value], ...]; change: called with them while one is dragged.
export function curveEditor(points, limit, change) {
  const top = limit ?? Math.max(1e-6, ...points.map(([, value]) => value)) * 1.25;
  const { svg, x, y } = axes([380, 780], top, "a curve: drag its points");
  const line = h("polyline", { class: "mean" });
  svg.append(line);
  const draw = () => {
    line.setAttribute("points", points.map(([nm, value]) => `${x(nm)},${y(Math.min(value, top))}`).join(" "));
    dots.forEach((dot, i) => dot.setAttribute("cy", y(Math.min(points[i][1], top))));
  };
  const set = (i, value) => { points[i][1] = Number(Math.min(top, Math.max(0, value)).toPrecision(4)); draw(); change(points); };
  const dots = points.map(([nm], i) => h("circle", {
    cx: x(nm), r: 5, class: "dot", tabindex: 0, role: "slider", "aria-label": `${nm} nm`,
    onpointerdown(event) { event.target.setPointerCapture(event.pointerId); },
    onpointermove(event) {
      if (!event.target.hasPointerCapture(event.pointerId)) return;
      const box = svg.getBoundingClientRect();
      const at = ((event.clientY - box.top) / box.height) * HEIGHT;
      set(i, ((HEIGHT - BOTTOM - at) / (HEIGHT - TOP - BOTTOM)) * top);
    },
    onkeydown(event) {
      const step = { ArrowUp: 0.02, ArrowDown: -0.02 }[event.key];
      if (step) { event.preventDefault(); event.stopPropagation(); set(i, points[i][1] + step * top); }
    },
  }));
  svg.append(...dots);
  draw();
  return svg;
}

// A small curve beside a value.
export function sparkline(values) {
  const top = Math.max(1e-12, ...values);
  const points = values.map((value, i) => `${(i / (values.length - 1)) * 60},${17 - (value / top) * 15}`);
  return h("svg", { viewBox: "0 0 60 18", class: "spark", "aria-hidden": "true" }, h("polyline", { class: "mean", points: points.join(" ") }));
}

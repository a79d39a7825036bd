// Elements in one line, and how numbers are shown.

export function h(tag, attributes = {}, ...children) {
  const svg = SVG.has(tag);
  const element = svg ? document.createElementNS("http://www.w3.org/2000/svg", tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (!svg && name in element && name !== "list") element[name] = value;
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat(Infinity).filter((child) => child !== undefined && child !== null));
  return element;
}

const SVG = new Set(["svg", "path", "line", "rect", "circle", "g", "text", "polyline", "linearGradient", "stop", "defs"]);

export function short(value, digits = 4) {
  if (value === null || value === undefined) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) return value.toExponential(2).replace("e+", "e");
  return String(Number(value.toPrecision(digits)));
}

// A mean with its error, with as many digits as the error lets one believe.
export function within(mean, error) {
  if (!(error > 0)) return `${short(mean, 3)} ± 0`;
  const digits = Math.min(8, Math.max(0, 1 - Math.floor(Math.log10(error))));
  return Math.abs(mean) >= 1e4 || digits === 8 ? `${short(mean, 3)} ± ${short(error, 2)}` : `${mean.toFixed(digits)} ± ${error.toFixed(digits)}`;
}

export function many(value) {
  for (const [limit, unit] of [[1e9, " G"], [1e6, " M"], [1e3, " k"]]) {
    if (value >= limit) return `${(value / limit).toPrecision(3)}${unit}`;
  }
  return `${Math.round(value)} `;
}

export function clock(seconds) {
  const whole = Math.floor(seconds);
  const pad = (n) => String(n).padStart(2, "0");
  const minutes = `${Math.floor(whole / 60) % 60}:${pad(whole % 60)}`;
  return whole >= 3600 ? `${Math.floor(whole / 3600)}:${minutes.padStart(5, "0")}` : minutes;
}

export function bytes(value) {
  for (const [limit, unit] of [[2 ** 30, "GiB"], [2 ** 20, "MiB"], [2 ** 10, "KiB"]]) {
    if (value >= limit) return `${(value / limit).toPrecision(3)} ${unit}`;
  }
  return `${value} bytes`;
}

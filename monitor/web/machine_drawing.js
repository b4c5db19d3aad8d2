// Drawings of small machines and of ways in a plane, as SVG. What a colour says, the caption says too.

function svg(tag, attributes, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

const rectangle = (x, y, width, height, kind) => svg("rect", { x, y, width, height, class: kind });
const line = (x1, y1, x2, y2, kind) => svg("line", { x1, y1, x2, y2, class: kind });

// A barrel with its rod, of which the part that is out is seen.
function cylinder(part) {
  const out = 70 * part;
  return [rectangle(4, 12, 90, 26, "body"), rectangle(12 + out * 1.05, 12, 6, 26, "moving"), line(18 + out * 1.05, 25, 98 + out, 25, "rod"),
    rectangle(98 + out, 15, 8, 20, "moving")];
}

// A disc with its stations; the mark at the top is where the tool works.
function turret(part, stations) {
  const count = Math.max(1, Math.min(stations ?? 1, 60));
  const shapes = [svg("circle", { cx: 100, cy: 25, r: 24, class: "body" })];
  for (let station = 0; station < count; station += 1) {
    const angle = ((station / count) - part) * 2 * Math.PI;
    const [x, y] = [100 + 19 * Math.sin(angle), 25 - 19 * Math.cos(angle)];
    const mark = svg("text", { x, y: y + 3, class: "station" });
    if (count <= 12) mark.textContent = String(station + 1);
    shapes.push(count <= 12 ? mark : svg("circle", { cx: x, cy: y, r: 1.5, class: "moving" }));
  }
  shapes.push(svg("path", { d: "M100 4 l-5 -4 h10 z", class: "moving" }));
  return shapes;
}

function pump(part) {
  const angle = (part - 0.5) * 1.5 * Math.PI;
  return [svg("circle", { cx: 30, cy: 25, r: 20, class: "body" }), svg("path", { d: "M20 15 L46 25 L20 35 z", class: "moving" }),
    svg("circle", { cx: 120, cy: 25, r: 22, class: "body" }),
    line(120, 25, 120 + 18 * Math.sin(angle), 25 - 18 * Math.cos(angle), "rod")];
}

// A contact, open or closed.
function contact(part) {
  return [line(10, 30, 70, 30, "rod"), line(70, 30, 120, part >= 1 ? 30 : 10, "moving-line"), line(120, 30, 190, 30, "rod"),
    svg("circle", { cx: 70, cy: 30, r: 3, class: "moving" }), svg("circle", { cx: 120, cy: 30, r: 3, class: "moving" })];
}

export function deviceDrawing(device) {
  const part = device.part ?? 0;
  const shapes = { cylinder: () => cylinder(part), turret: () => turret(part, device.stations), pump: () => pump(part) }[device.kind] ?? (() => contact(part));
  return svg("svg", { viewBox: "0 0 200 50", class: "device-drawing", role: "img", "aria-label": `${device.name}: ${device.text}` }, ...shapes());
}

const WIDTH = 600;
const HEIGHT = 420;
const MARGIN = 24;

// A way with equal scales; the cross is the last point.
export function pathDrawing(path) {
  const xs = path.points.map((point) => point[0]);
  const ys = path.points.map((point) => point[1]);
  const low = (values) => values.reduce((least, value) => Math.min(least, value), Infinity);
  const high = (values) => values.reduce((most, value) => Math.max(most, value), -Infinity);
  const drawing = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "path-drawing", role: "img", "aria-label": path.name });
  if (!path.points.length) return drawing;
  const [left, right, bottom, top] = [low(xs), high(xs), low(ys), high(ys)];
  const scale = Math.min((WIDTH - 2 * MARGIN) / Math.max(right - left, 1e-6), (HEIGHT - 2 * MARGIN) / Math.max(top - bottom, 1e-6), 1e6);
  const x = (value) => WIDTH / 2 + (value - (left + right) / 2) * scale;
  const y = (value) => HEIGHT / 2 - (value - (bottom + top) / 2) * scale;
  const points = path.points.map((point) => `${x(point[0]).toFixed(1)},${y(point[1]).toFixed(1)}`).join(" ");
  const [hereX, hereY] = [x(xs.at(-1)), y(ys.at(-1))];
  const label = (text, atX, atY, anchor) => {
    const made = svg("text", { x: atX, y: atY, "text-anchor": anchor, class: "scale" });
    made.textContent = text;
    return made;
  };
  drawing.append(rectangle(0.5, 0.5, WIDTH - 1, HEIGHT - 1, "frame"), svg("polyline", { points, class: "way" }),
    line(hereX - 8, hereY, hereX + 8, hereY, "here"), line(hereX, hereY - 8, hereX, hereY + 8, "here"),
    label(`X ${Number(left.toFixed(3))} to ${Number(right.toFixed(3))}`, 8, HEIGHT - 8, "start"),
    label(`Y ${Number(bottom.toFixed(3))} to ${Number(top.toFixed(3))}`, WIDTH - 8, HEIGHT - 8, "end"));
  return drawing;
}

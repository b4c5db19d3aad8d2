// The drawing of the scope on a canvas: one lane a variable, time from left to right.

const LEFT = 150;
const RIGHT = 14;
const TOP = 18;
const BOTTOM = 26;
const LOGICAL_LANE = 30;
const NUMBER_LANE = 96;
const GAP = 10;

// Steps of 1, 2 or 5 times a power of ten, of which about `count` fit into a length.
function niceStep(length, count) {
  const rough = length / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= rough) ?? power;
}

export function timeText(seconds) {
  const size = Math.abs(seconds);
  if (size >= 1 || size === 0) return `${Number(seconds.toFixed(3))} s`;
  if (size >= 1e-3) return `${Number((seconds * 1e3).toFixed(3))} ms`;
  return `${Number((seconds * 1e6).toFixed(3))} µs`;
}

// Which colours a theme has, from the style sheet.
function colours(element) {
  const style = getComputedStyle(element);
  const of = (name) => style.getPropertyValue(name).trim();
  return {
    background: of("--paper"), text: of("--ink"), faint: of("--line"), dim: of("--dim"), cursor: of("--accent"), trigger: of("--warning"),
    waves: [of("--wave1"), of("--wave2"), of("--wave3"), of("--wave4")],
  };
}

export class Drawing {
  constructor(canvas) {
    this.canvas = canvas;
  }

  // How high the lanes of a view are, axis included.
  static height(view) {
    return view.channels.reduce((sum, channel) => sum + GAP + (channel.logical ? LOGICAL_LANE : NUMBER_LANE), TOP + BOTTOM);
  }

  // Draws a view (as the server sends it). `tickSeconds` is the length of a tick.
  draw(view, tickSeconds, activeCursor, follows) {
    const width = this.canvas.clientWidth;
    const height = Math.max(120, Drawing.height(view));
    const scale = window.devicePixelRatio || 1;
    this.canvas.style.height = `${height}px`;
    this.canvas.width = Math.round(width * scale);
    this.canvas.height = Math.round(height * scale);
    const context = this.canvas.getContext("2d");
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.font = "13px ui-monospace, monospace";
    const colour = colours(this.canvas);
    context.fillStyle = colour.background;
    context.fillRect(0, 0, width, height);
    Object.assign(this, { follows, view, from: view.from, to: Math.max(view.to, view.from) + 1, width, context, colour });
    this.drawAxis(height, tickSeconds);
    let top = TOP;
    view.channels.forEach((channel, at) => {
      const lane = channel.logical ? LOGICAL_LANE : NUMBER_LANE;
      this.drawChannel(channel, top, lane, colour.waves[at % colour.waves.length]);
      top += lane + GAP;
    });
    if (!follows) this.drawMark(view.tick, height, "▲", colour.dim, [1, 3]);
    if (view.trigger_tick !== null) this.drawMark(view.trigger_tick, height, "T", colour.trigger, [2, 3]);
    view.cursors.forEach((tick, at) => {
      if (tick !== null) this.drawMark(tick, height, "AB"[at] + (at === activeCursor ? "◂" : ""), colour.cursor, at === 0 ? [] : [7, 4]);
    });
  }

  x(tick) {
    return LEFT + ((tick - this.from) / (this.to - this.from)) * (this.width - LEFT - RIGHT);
  }

  // The tick under a place of the canvas.
  tickAt(x) {
    const share = (x - LEFT) / (this.width - LEFT - RIGHT);
    return Math.round(this.from + share * (this.to - this.from) - 0.5);
  }

  drawAxis(height, tickSeconds) {
    const { context, colour } = this;
    if (this.view.trigger_tick === null) return this.drawTimes(height);
    const zero = this.view.trigger_tick ?? 0;
    const step = niceStep((this.to - this.from) * tickSeconds || 1, Math.max(2, (this.width - LEFT) / 110));
    context.lineWidth = 1;
    for (let number = Math.ceil(((this.from - zero) * tickSeconds) / step); number < 1e6; number += 1) {
      const tick = zero + (number * step) / tickSeconds;
      if (!(tick <= this.to)) break;
      const x = Math.round(this.x(tick)) + 0.5;
      context.strokeStyle = colour.faint;
      context.setLineDash([]);
      context.beginPath();
      context.moveTo(x, TOP - 4);
      context.lineTo(x, height - BOTTOM + 4);
      context.stroke();
      context.fillStyle = colour.dim;
      context.textAlign = "center";
      context.fillText(timeText(number * step), Math.min(x, this.width - 30), height - 8);
    }
  }

  // Marks at round times, of the day where that is known.
  drawTimes(height) {
    const { context, colour } = this;
    context.lineWidth = 1;
    context.setLineDash([]);
    let free = LEFT - 20;
    for (const mark of this.view.axis) {
      const x = Math.round(this.x(mark.tick)) + 0.5;
      context.strokeStyle = colour.faint;
      context.beginPath();
      context.moveTo(x, TOP - 4);
      context.lineTo(x, height - BOTTOM + 4);
      context.stroke();
      const half = context.measureText(mark.text).width / 2;
      if (x - half < free || x + half > this.width) continue;
      free = x + half + 10;
      context.fillStyle = colour.dim;
      context.textAlign = "center";
      context.fillText(mark.text, x, height - 8);
    }
  }

  drawChannel(channel, top, lane, wave) {
    const { context, colour } = this;
    const low = channel.logical ? 0 : channel.low;
    const high = channel.logical ? 1 : channel.high;
    const range = high > low ? high - low : 1;
    const inset = channel.logical ? 4 : 6;
    const y = (value) => top + lane - inset - ((value - low) / range) * (lane - 2 * inset);
    context.setLineDash([]);
    context.strokeStyle = colour.faint;
    context.strokeRect(LEFT + 0.5, top + 0.5, this.width - LEFT - RIGHT, lane);
    context.textAlign = "right";
    context.fillStyle = colour.text;
    const name = channel.name.length > 17 ? `${channel.name.slice(0, 16)}…` : channel.name;
    context.fillText(name, LEFT - 8, top + lane / 2 + 4);
    if (!channel.logical) {
      context.fillStyle = colour.dim;
      context.fillText(String(channel.high), LEFT - 8, top + 12);
      context.fillText(String(channel.low), LEFT - 8, top + lane - 2);
    }
    context.save();
    context.beginPath();
    context.rect(LEFT, top, this.width - LEFT - RIGHT, lane + 1);
    context.clip();
    const { samples } = channel;
    samples.forEach((sample, at) => {
      const end = samples[at + 1]?.tick ?? this.to;
      const [left, right] = [this.x(sample.tick), this.x(end)];
      if (sample.high > sample.low) {
        // Several values in one stretch: the band between them.
        context.globalAlpha = 0.35;
        context.fillStyle = wave;
        context.fillRect(left, y(sample.high), Math.max(1, right - left), Math.max(1, y(sample.low) - y(sample.high)));
        context.globalAlpha = 1;
      } else if (channel.logical && sample.last) {
        context.globalAlpha = 0.18;
        context.fillStyle = wave;
        context.fillRect(left, y(1), right - left, y(0) - y(1));
        context.globalAlpha = 1;
      }
    });
    context.strokeStyle = wave;
    context.lineWidth = 2;
    context.beginPath();
    samples.forEach((sample, at) => {
      const end = samples[at + 1]?.tick ?? this.to;
      if (at === 0) context.moveTo(this.x(sample.tick), y(sample.last));
      context.lineTo(this.x(sample.tick), y(sample.last));
      context.lineTo(this.x(end), y(sample.last));
    });
    context.stroke();
    context.restore();
    context.lineWidth = 1;
  }

  drawMark(tick, height, label, colour, dash) {
    const x = Math.round(this.x(tick)) + 0.5;
    if (x < LEFT - 1 || x > this.width - RIGHT + 1) return;
    const { context } = this;
    context.strokeStyle = colour;
    context.fillStyle = colour;
    context.lineWidth = 1.5;
    context.setLineDash(dash);
    context.beginPath();
    context.moveTo(x, TOP - 4);
    context.lineTo(x, height - BOTTOM);
    context.stroke();
    context.setLineDash([]);
    context.textAlign = "center";
    context.fillText(label, x, 12);
  }
}

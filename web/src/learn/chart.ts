/** A curve over decisions, drawn on a canvas. */
import { el } from "../app/dom";

interface Point {
  readonly x: number;
  readonly y: number;
}

export interface ChartOptions {
  readonly label: string;
  /** Name of a CSS variable. */
  readonly color: string;
  readonly digits: number;
}

const [LEFT, RIGHT, TOP, BOTTOM] = [44, 8, 8, 20];
/** The curve of the return. */
export function returnChart(end: number): Chart {
  return new Chart({ label: "Return per episode", color: "--accent-line", digits: 0 }, end);
}

/** The curve of the speed. */
export function speedChart(end: number): Chart {
  return new Chart({ label: "Speed, m/s", color: "--second-line", digits: 2 }, end);
}

/** Most points that are drawn. */
const MOST = 400;

export class Chart {
  readonly element: HTMLElement;
  readonly #canvas = el("canvas", { role: "img" });
  readonly #options: ChartOptions;
  readonly #points: Point[] = [];
  #end: number;
  #pending = false;

  constructor(options: ChartOptions, end: number) {
    this.#options = options;
    this.#end = end;
    this.element = el("figure", { class: "chart" }, el("figcaption", {}, options.label), this.#canvas);
    new ResizeObserver(() => this.#later()).observe(this.#canvas);
    this.#later();
  }

  get last(): number | null {
    return this.#points.at(-1)?.y ?? null;
  }

  get first(): number | null {
    return this.#points[0]?.y ?? null;
  }

  /** Begins a new curve up to a number of decisions. */
  clear(end: number): void {
    this.#end = end;
    this.#points.length = 0;
    this.#later();
  }

  add(x: number, y: number | null): void {
    if (y === null || !Number.isFinite(y)) return;
    this.#points.push({ x, y });
    this.#later();
  }

  /** Draws once per frame, however many points come. */
  #later(): void {
    if (this.#pending) return;
    this.#pending = true;
    requestAnimationFrame(() => {
      this.#pending = false;
      this.#draw();
    });
  }

  #draw(): void {
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    const context = this.#canvas.getContext("2d");
    if (context === null || width === 0) return;
    const ratio = devicePixelRatio || 1;
    this.#canvas.width = Math.round(width * ratio);
    this.#canvas.height = Math.round(height * ratio);
    context.scale(ratio, ratio);
    const style = getComputedStyle(this.#canvas);
    const low = Math.min(0, ...this.#points.map(({ y }) => y));
    const high = Math.max(low + 1e-6, 1, ...this.#points.map(({ y }) => y));
    const ticks = ticksOf(low, high);
    const top = Math.max(high, ticks.at(-1) ?? high);
    const at = (x: number, y: number): [number, number] => [
      LEFT + ((width - LEFT - RIGHT) * x) / this.#end,
      height - BOTTOM - ((height - TOP - BOTTOM) * (y - low)) / (top - low),
    ];
    context.font = "11px system-ui, sans-serif";
    context.fillStyle = style.getPropertyValue("--muted");
    context.strokeStyle = style.getPropertyValue("--line");
    context.textAlign = "right";
    context.textBaseline = "middle";
    for (const tick of ticks) {
      const [, y] = at(0, tick);
      context.beginPath();
      context.moveTo(LEFT, y);
      context.lineTo(width - RIGHT, y);
      context.stroke();
      context.fillText(tick >= 1000 ? `${tick / 1000} k` : String(tick), LEFT - 6, y);
    }
    context.textBaseline = "bottom";
    context.fillText(`${(this.#end / 1e6).toFixed(1)} M decisions`, width - RIGHT, height);
    context.textAlign = "left";
    context.fillText("0", LEFT, height);
    this.#line(context, style.getPropertyValue(this.#options.color), at);
    const last = this.last;
    this.#canvas.setAttribute(
      "aria-label",
      last === null ? `${this.#options.label}: no value yet` : `${this.#options.label}: ${last.toFixed(this.#options.digits)} now`,
    );
  }

  #line(context: CanvasRenderingContext2D, color: string, at: (x: number, y: number) => [number, number]): void {
    const every = Math.max(Math.ceil(this.#points.length / MOST), 1);
    context.strokeStyle = color;
    context.lineWidth = 2;
    context.lineJoin = "round";
    context.beginPath();
    for (const [i, { x, y }] of this.#points.entries()) {
      if (i % every !== 0 && i !== this.#points.length - 1) continue;
      context.lineTo(...at(x, y));
    }
    context.stroke();
    const last = this.#points.at(-1);
    if (!last) return;
    context.fillStyle = color;
    context.beginPath();
    context.arc(...at(last.x, last.y), 3.5, 0, 2 * Math.PI);
    context.fill();
  }
}

/** Three or four round numbers between two. */
function ticksOf(low: number, high: number): number[] {
  const rough = (high - low) / 3;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((x) => x * power).find((x) => x >= rough) ?? rough;
  const ticks: number[] = [];
  for (let tick = Math.ceil(low / step) * step; tick <= high + 0.3 * step; tick += step) ticks.push(Number(tick.toPrecision(6)));
  return ticks;
}

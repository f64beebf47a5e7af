/** The keyboard, with the keys of the game. */
import { type Action, type Deflection, type Device, type OnAction } from "./controls";

/** Pace without Shift. */
const WALK = 0.5;

const ACTIONS: Readonly<Record<string, Action>> = {
  Enter: "pause",
  Period: "step",
  KeyX: "restart",
  KeyN: "next",
  KeyC: "camera",
  KeyP: "push",
  KeyB: "throw",
  KeyG: "release",
  Minus: "slower",
  Equal: "faster",
};

const STEERING = new Set(["KeyW", "KeyA", "KeyS", "KeyD", "ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight", "Space", "KeyV"]);

/** Keys for the help. */
export const KEYS: readonly (readonly [string, string])[] = [
  ["W A S D, arrows", "move"],
  ["Shift", "run"],
  ["Space", "jump"],
  ["V", "backflip"],
  ["B", "throw a ball"],
  ["P", "push"],
  ["C", "camera"],
  ["X", "restart"],
  ["Enter", "pause"],
  [".", "one step"],
  ["- and =", "slower, faster"],
  ["N", "next character"],
  ["G", "autopilot"],
  ["?", "keys"],
];

export class Keyboard implements Device {
  readonly #held = new Set<string>();
  readonly #abort = new AbortController();
  readonly #onAction: OnAction;

  constructor(onAction: OnAction) {
    this.#onAction = onAction;
    const { signal } = this.#abort;
    addEventListener("keydown", (event) => this.#down(event), { signal });
    addEventListener("keyup", ({ code }) => this.#held.delete(code), { signal });
    // a key that is released elsewhere would be held forever
    addEventListener("blur", () => this.#held.clear(), { signal });
  }

  read(): Deflection {
    const held = (...codes: string[]): number => Number(codes.some((code) => this.#held.has(code)));
    const [x, y] = [held("KeyD", "ArrowRight") - held("KeyA", "ArrowLeft"), held("KeyW", "ArrowUp") - held("KeyS", "ArrowDown")];
    const pace = held("ShiftLeft", "ShiftRight") === 1 ? 1 : WALK;
    const length = Math.hypot(x, y) || 1;
    return {
      right: (x / length) * pace,
      ahead: (y / length) * pace,
      jump: held("Space") === 1,
      flip: held("KeyV") === 1,
      look: [0, 0],
    };
  }

  dispose(): void {
    this.#abort.abort();
  }

  #down(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey || usesKey(event)) return;
    this.#held.add(event.code);
    if (STEERING.has(event.code)) event.preventDefault();
    if (event.repeat) return;
    const action = event.key === "?" ? "help" : ACTIONS[event.code];
    if (action !== undefined) {
      event.preventDefault();
      this.#onAction(action);
    }
  }
}

/** Whether the focused control needs the key itself. */
function usesKey({ target, code }: KeyboardEvent): boolean {
  if (!(target instanceof HTMLElement)) return false;
  const tag = target.tagName;
  if (tag === "SELECT" || tag === "TEXTAREA" || target.isContentEditable) return true;
  if (tag === "INPUT") {
    const { type } = target as HTMLInputElement;
    return type === "range" ? code.startsWith("Arrow") || code === "Space" : true;
  }
  return (tag === "BUTTON" || tag === "A" || tag === "SUMMARY") && (code === "Space" || code === "Enter");
}

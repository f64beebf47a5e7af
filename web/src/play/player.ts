/** An arena with the devices and the panel that steer it, for the views Play and Policies. */
import type { EnvOptions } from "marathon-rl";
import { button, el, toggle } from "../app/dom";
import type { Context } from "../app/view";
import { type Action, combine } from "../input/controls";
import { Gamepads } from "../input/gamepad";
import { KEYS, Keyboard } from "../input/keyboard";
import { PointerControl } from "../input/pointer";
import { TouchControls } from "../input/touch";
import { Arena, type ArenaOptions } from "./arena";

/** Speeds of time that keys choose. */
const SPEEDS = [0.1, 0.25, 0.5, 1, 2] as const;
const SLOW = 0.25;

export interface PlayerOptions {
  readonly agent: string;
  readonly env: EnvOptions;
  readonly distance: number;
  readonly skin: ArenaOptions["skin"];
  /** Goes to the next character, where there is one. */
  readonly next?: () => void;
}

export class Player {
  readonly arena: Arena;
  /** Buttons for the panel. */
  readonly controls: HTMLElement;
  readonly #context: Context;
  readonly #keyboard: Keyboard;
  readonly #pads: Gamepads;
  readonly #touch: TouchControls;
  readonly #pointer: PointerControl;
  readonly #hud = el("p", { class: "hud", "aria-hidden": "true" });
  readonly #hint = el("p", { class: "hint" });
  readonly #pause: ReturnType<typeof toggle>;
  readonly #slow: ReturnType<typeof toggle>;
  readonly #next: (() => void) | undefined;
  #timer = 0;

  constructor(context: Context, { agent, env, distance, skin, next }: PlayerOptions) {
    this.#context = context;
    this.#next = next;
    const onAction = (action: Action): void => this.act(action);
    this.#keyboard = new Keyboard(onAction);
    this.#pads = new Gamepads(onAction);
    let touch: TouchControls | null = null;
    const read = () => combine([this.#keyboard.read(), this.#pads.read(), ...(touch ? [touch.read()] : [])]);
    this.arena = new Arena(context.stage, context.marathon, {
      agent,
      options: env,
      distance,
      skin,
      read,
      onError: (error) => context.fail(error),
    });
    const { buttons, takesCommands } = this.arena;
    touch = new TouchControls(onAction, { jump: buttons.length > 0, flip: buttons.length > 1, steers: takesCommands });
    this.#touch = touch;
    this.#pointer = new PointerControl(context.stage, this.arena.puppet);
    this.#pause = toggle("Pause", false, (on) => (this.arena.clock.paused = on));
    this.#slow = toggle("Slow motion", false, (on) => (this.arena.clock.speed = on ? SLOW : 1));
    this.controls = this.#makeControls(skin !== null);
    context.overlay.append(this.#hud, this.#hint);
    if (TouchControls.wanted()) context.overlay.append(touch.element);
    context.stage.canvas.setAttribute("aria-label", describe(takesCommands));
    this.#timer = window.setInterval(() => this.#report(), 200);
    this.#report();
    context.stage.show(this.arena);
  }

  act(action: Action): void {
    const { arena } = this;
    switch (action) {
      case "pause":
        this.#pause.click();
        break;
      case "step":
        this.#pause.set(true);
        arena.clock.paused = true;
        arena.clock.step();
        break;
      case "restart":
        arena.reset();
        break;
      case "next":
        this.#next?.();
        break;
      case "camera":
        this.#context.say(`Camera: ${this.#context.stage.follow.next()}`);
        break;
      case "push":
        arena.push();
        break;
      case "throw":
        arena.puppet.throwBall();
        break;
      case "release":
        arena.own = true;
        break;
      case "slower":
      case "faster":
        this.#change(action === "slower" ? -1 : 1);
        break;
      case "help":
        this.controls.querySelector("details")?.toggleAttribute("open");
        break;
    }
  }

  dispose(): void {
    clearInterval(this.#timer);
    this.#keyboard.dispose();
    this.#pads.dispose();
    this.#touch.dispose();
    this.#pointer.dispose();
    this.arena.dispose();
  }

  #change(by: number): void {
    const { clock } = this.arena;
    const at = SPEEDS.findIndex((speed) => speed >= clock.speed);
    clock.speed = SPEEDS[Math.min(Math.max(at + by, 0), SPEEDS.length - 1)] ?? 1;
    this.#slow.set(clock.speed < 1);
    this.#context.say(`Speed of time: ${clock.speed}`);
  }

  #makeControls(skinned: boolean): HTMLElement {
    const act = (label: string, action: Action): HTMLElement => button(label, () => this.act(action));
    const keys = el("dl", { class: "keys" });
    for (const [key, what] of KEYS) keys.append(el("dt", {}, key), el("dd", {}, what));
    const skin = toggle("Skin", true, (on) => (this.arena.puppet.skinned = on));
    return el(
      "div",
      { class: "stack" },
      el("div", { class: "row" }, act("Throw a ball", "throw"), act("Push", "push"), act("Restart", "restart")),
      el("div", { class: "row" }, this.#pause, this.#slow, act("Camera", "camera"), skinned && skin),
      el("details", {}, el("summary", {}, "Keys, mouse and gamepad"), keys, el("p", {}, MOUSE)),
    );
  }

  /** Speed and distance, and what to do first. */
  #report(): void {
    const { arena } = this;
    const { x, y } = arena.puppet.center;
    this.#hud.textContent = `${arena.speed.toFixed(1)} m/s · ${Math.hypot(x, y).toFixed(0)} m from the start`;
    const hint = !arena.takesCommands
      ? "Drag a limb to pull it. Drag beside it to look around."
      : TouchControls.wanted()
        ? "Steer with the stick. Drag a limb to pull it."
        : "Steer with W A S D. Drag a limb to pull it.";
    this.#hint.textContent = hint;
    this.#hint.hidden = arena.takesCommands ? !arena.own : arena.steps > 600;
  }
}

const MOUSE =
  "Drag a limb to pull it, click it to push it. Drag beside the character to look around; use the wheel or two fingers to zoom. On a " +
  "gamepad, the left stick moves, the right stick looks around, A jumps, B flips, the right trigger throws a ball.";

function describe(steers: boolean): string {
  return steers
    ? "Picture of the simulation. W, A, S, D or the arrow keys move the character, Space jumps, B throws a ball, question mark lists all keys."
    : "Picture of the simulation. B throws a ball, P pushes, question mark lists all keys.";
}

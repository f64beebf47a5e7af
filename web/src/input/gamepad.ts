/** Gamepads with the standard layout. */
import { type Action, type Deflection, type Device, type OnAction, REST } from "./controls";

/** Deflection up to which a stick counts as released. The response begins at 0 beyond it. */
const DEAD_ZONE = 0.12;
/** Turn of the camera at full deflection, rad/s. */
const LOOK = 2.4;

/** Numbers of buttons in the standard layout. */
const [SOUTH, EAST, WEST, NORTH] = [0, 1, 2, 3];
const ACTIONS: readonly (readonly [number, Action])[] = [
  [WEST, "restart"],
  [NORTH, "next"],
  [6, "push"], // left trigger
  [7, "throw"], // right trigger
  [4, "camera"], // left bumper
  [8, "pause"],
  [9, "pause"],
  [10, "release"], // left stick
  [12, "faster"],
  [13, "slower"],
];

export class Gamepads implements Device {
  readonly #onAction: OnAction;
  #pressed = new Set<number>();
  #forbidden = false;

  constructor(onAction: OnAction) {
    this.#onAction = onAction;
  }

  read(): Deflection {
    const pad = this.#pad();
    if (!pad) return REST;
    const pressed = new Set(pad.buttons.flatMap((button, i) => (button.pressed || button.value > 0.5 ? [i] : [])));
    for (const [button, action] of ACTIONS) {
      if (pressed.has(button) && !this.#pressed.has(button)) this.#onAction(action);
    }
    this.#pressed = pressed;
    const axis = (i: number): number => respond(pad.axes[i] ?? 0);
    return {
      right: axis(0),
      ahead: -axis(1),
      jump: pressed.has(SOUTH),
      flip: pressed.has(EAST),
      look: [-LOOK * axis(2), LOOK * axis(3)],
    };
  }

  dispose(): void {}

  #pad(): Gamepad | null {
    if (this.#forbidden) return null;
    try {
      return navigator.getGamepads?.().find((pad) => pad?.connected === true) ?? null;
    } catch {
      // the page's host does not allow them
      this.#forbidden = true;
      return null;
    }
  }
}

/** The response to a deflection. */
function respond(x: number): number {
  const beyond = Math.min(Math.max((Math.abs(x) - DEAD_ZONE) / (1 - DEAD_ZONE), 0), 1);
  return beyond * Math.sign(x);
}

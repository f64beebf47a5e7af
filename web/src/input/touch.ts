/** A stick and buttons on the screen, for thumbs. */
import { el } from "../app/dom";
import { type Action, type Deflection, type Device, type OnAction } from "./controls";

/** Way of the thumb at full deflection, CSS pixels. */
const REACH = 52;

interface Buttons {
  readonly jump: boolean;
  readonly flip: boolean;
  readonly steers: boolean;
}

export class TouchControls implements Device {
  readonly element = el("div", { class: "touch" });
  #stick: readonly [number, number] = [0, 0];
  #jump = false;
  #flip = false;

  constructor(onAction: OnAction, buttons: Buttons) {
    if (buttons.steers) this.element.append(this.#makeStick());
    const group = el("div", { class: "thumbs" });
    if (buttons.flip) group.append(this.#hold("Flip", (on) => (this.#flip = on)));
    if (buttons.jump) group.append(this.#hold("Jump", (on) => (this.#jump = on)));
    const act = (label: string, action: Action): HTMLElement =>
      el("button", { type: "button", class: "thumb small", tabindex: -1, click: () => onAction(action) }, label);
    group.append(act("Ball", "throw"));
    this.element.append(group);
  }

  /** Whether the device has a touch screen. */
  static wanted(): boolean {
    return navigator.maxTouchPoints > 0 || matchMedia("(any-pointer: coarse)").matches;
  }

  read(): Deflection {
    const [right, ahead] = this.#stick;
    return { right, ahead, jump: this.#jump, flip: this.#flip, look: [0, 0] };
  }

  dispose(): void {
    this.element.remove();
  }

  #makeStick(): HTMLElement {
    const knob = el("div", { class: "knob" });
    // the keyboard steers as well, so that the stick needs no focus
    const stick = el("div", { class: "stick", "aria-hidden": "true" }, knob);
    let start: readonly [number, number] | null = null;
    const move = (x: number, y: number): void => {
      const length = Math.max(Math.hypot(x, y) / REACH, 1);
      const [right, down] = [x / REACH / length, y / REACH / length];
      this.#stick = [right, -down];
      knob.style.transform = `translate(${right * REACH}px, ${down * REACH}px)`;
    };
    stick.addEventListener("pointerdown", (event) => {
      stick.setPointerCapture(event.pointerId);
      const box = stick.getBoundingClientRect();
      start = [box.x + box.width / 2, box.y + box.height / 2];
      move(event.clientX - start[0], event.clientY - start[1]);
      event.preventDefault();
    });
    stick.addEventListener("pointermove", (event) => {
      if (start) move(event.clientX - start[0], event.clientY - start[1]);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      stick.addEventListener(end, () => {
        start = null;
        move(0, 0);
      });
    }
    return stick;
  }

  #hold(label: string, set: (on: boolean) => void): HTMLElement {
    const made = el("button", { type: "button", class: "thumb", tabindex: -1 }, label);
    made.addEventListener("pointerdown", (event) => {
      made.setPointerCapture(event.pointerId);
      set(true);
    });
    for (const end of ["pointerup", "pointercancel", "blur"]) made.addEventListener(end, () => set(false));
    made.addEventListener("contextmenu", (event) => event.preventDefault());
    return made;
  }
}

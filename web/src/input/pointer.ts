/** Mouse and fingers on the picture: pull a limb, push it by a click, turn the camera, zoom. */
import { Plane, Raycaster, Vector2, Vector3 } from "three";
import { isEmbedded } from "../app/route";
import type { Picked } from "../scene/rods";
import type { Stage } from "../scene/stage";
import type { Ray } from "three";

/** Bodies that can be pulled and pushed. */
export interface Hands {
  pick(ray: Ray, slack: number): Picked | null;
  grab(picked: Picked): void;
  /** The held point is to go there. */
  pull(goal: Vector3): void;
  letGo(): void;
  /** A click on a body, in a direction. */
  push(picked: Picked, direction: Vector3): void;
}

/** Nothing can be pulled: the mouse turns and zooms. */
export const NO_HANDS: Hands = { pick: () => null, grab() {}, pull() {}, letGo() {}, push() {} };

/** Turn of the camera per pixel, rad. */
const TURN = 0.006;
/** Way of a click that is no drag, pixels. */
const STILL = 5;
/** Thickness of a finger, and of a mouse's tip, m. */
const SLACK = { touch: 0.05, mouse: 0.015 };

export class PointerControl {
  readonly #stage: Stage;
  readonly #hands: Hands;
  readonly #abort = new AbortController();
  readonly #raycaster = new Raycaster();
  readonly #fingers = new Map<number, Vector2>();
  /** The body under the pointer that went down, and whether it is held. */
  #picked: Picked | null = null;
  #held = false;
  #moved = 0;
  #spread = 0;

  constructor(stage: Stage, hands: Hands) {
    this.#stage = stage;
    this.#hands = hands;
    const { canvas } = stage;
    const { signal } = this.#abort;
    canvas.addEventListener("pointerdown", (event) => this.#down(event), { signal });
    canvas.addEventListener("pointermove", (event) => this.#move(event), { signal });
    canvas.addEventListener("pointerup", (event) => this.#up(event), { signal });
    canvas.addEventListener("pointercancel", (event) => this.#up(event), { signal });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault(), { signal });
    const embedded = isEmbedded(new URL(location.href));
    const wheel = (event: WheelEvent): void => {
      // the wheel scrolls the page around it until the picture is clicked
      if (embedded && !event.ctrlKey && document.activeElement !== canvas) return;
      stage.follow.zoom(Math.exp(0.0012 * event.deltaY * (event.deltaMode === 1 ? 30 : 1)));
      event.preventDefault();
    };
    canvas.addEventListener("wheel", wheel, { signal, passive: false });
  }

  dispose(): void {
    this.#abort.abort();
    if (this.#held) this.#hands.letGo();
  }

  #ray({ clientX, clientY }: PointerEvent): Ray {
    const box = this.#stage.canvas.getBoundingClientRect();
    const at = new Vector2(((clientX - box.x) / box.width) * 2 - 1, 1 - ((clientY - box.y) / box.height) * 2);
    this.#stage.camera.updateMatrixWorld();
    this.#raycaster.setFromCamera(at, this.#stage.camera);
    return this.#raycaster.ray;
  }

  #down(event: PointerEvent): void {
    const { canvas } = this.#stage;
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true });
    this.#fingers.set(event.pointerId, new Vector2(event.clientX, event.clientY));
    this.#moved = 0;
    if (this.#fingers.size > 1) {
      this.#end();
      this.#spread = this.#span();
      return;
    }
    if (event.button !== 0) return;
    this.#picked = this.#hands.pick(this.#ray(event), event.pointerType === "touch" ? SLACK.touch : SLACK.mouse);
  }

  #move(event: PointerEvent): void {
    const before = this.#fingers.get(event.pointerId);
    if (!before) {
      this.#hover(event);
      return;
    }
    const [dx, dy] = [event.clientX - before.x, event.clientY - before.y];
    before.set(event.clientX, event.clientY);
    this.#moved += Math.hypot(dx, dy);
    const { follow } = this.#stage;
    if (this.#fingers.size > 1) {
      const span = this.#span();
      if (this.#spread > 0 && span > 0) follow.zoom(this.#spread / span);
      this.#spread = span;
      follow.turn(-0.5 * TURN * dx, 0.5 * TURN * dy);
    } else if (this.#picked) {
      if (!this.#held && this.#moved > STILL) {
        this.#held = true;
        this.#hands.grab(this.#picked);
      }
      if (this.#held) this.#pull(event, this.#picked);
    } else {
      follow.turn(-TURN * dx, TURN * dy);
    }
  }

  /** The goal is in the plane through the first hit that faces the camera. */
  #pull(event: PointerEvent, { at }: Picked): void {
    const normal = this.#stage.camera.getWorldDirection(new Vector3());
    const goal = this.#ray(event).intersectPlane(new Plane().setFromNormalAndCoplanarPoint(normal, at), new Vector3());
    if (goal) this.#hands.pull(goal);
  }

  #hover(event: PointerEvent): void {
    if (event.pointerType !== "mouse") return;
    this.#stage.canvas.style.cursor = this.#hands.pick(this.#ray(event), SLACK.mouse) ? "grab" : "";
  }

  #up(event: PointerEvent): void {
    if (!this.#fingers.delete(event.pointerId)) return;
    if (this.#picked && !this.#held && this.#moved <= STILL && event.type === "pointerup") {
      this.#hands.push(this.#picked, this.#ray(event).direction.clone());
    }
    this.#end();
  }

  #end(): void {
    if (this.#held) this.#hands.letGo();
    this.#held = false;
    this.#picked = null;
  }

  #span(): number {
    const [a, b] = [...this.#fingers.values()];
    return a && b ? a.distanceTo(b) : 0;
  }
}

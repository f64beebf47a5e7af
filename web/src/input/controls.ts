/** The common state of all devices: a stick, two buttons that are held, and actions that happen once. */

/** Things that happen once per press. */
export type Action = "pause" | "step" | "restart" | "next" | "camera" | "push" | "throw" | "release" | "slower" | "faster" | "help";

/** The state of a device. */
export interface Deflection {
  /** To the right and ahead in the picture, within a circle of radius 1. */
  readonly right: number;
  readonly ahead: number;
  readonly jump: boolean;
  readonly flip: boolean;
  /** Turn of the camera, rad/s. */
  readonly look: readonly [number, number];
}

export const REST: Deflection = { right: 0, ahead: 0, jump: false, flip: false, look: [0, 0] };

export interface Device {
  /** The state now. Called once per frame. */
  read(): Deflection;
  dispose(): void;
}

export type OnAction = (action: Action) => void;

/** The device that is pushed farthest steers; a button counts on every device. */
export function combine(deflections: readonly Deflection[]): Deflection {
  const size = ({ right, ahead }: Deflection): number => Math.hypot(right, ahead);
  const most = deflections.reduce((a, b) => (size(b) > size(a) ? b : a), REST);
  const length = Math.max(size(most), 1);
  return {
    right: most.right / length,
    ahead: most.ahead / length,
    jump: deflections.some(({ jump }) => jump),
    flip: deflections.some(({ flip }) => flip),
    look: [sum(deflections, 0), sum(deflections, 1)],
  };
}

function sum(deflections: readonly Deflection[], axis: 0 | 1): number {
  return deflections.reduce((total, { look }) => total + look[axis], 0);
}

export function isRest({ right, ahead, jump, flip }: Deflection): boolean {
  return right === 0 && ahead === 0 && !jump && !flip;
}

/** Colors of figures, ground and sky. They are those of the game. All are sRGB. */
import type { Geom, ModelInfo } from "marathon-rl";

export type Rgb = readonly [number, number, number];

/** Colors of figures in a row. */
export const TINTS: readonly Rgb[] = [
  [0.93, 0.42, 0.16],
  [0.13, 0.53, 0.8],
  [0.22, 0.65, 0.38],
  [0.8, 0.27, 0.46],
  [0.5, 0.38, 0.78],
  [0.88, 0.66, 0.14],
  [0.1, 0.62, 0.62],
  [0.7, 0.36, 0.2],
];
/** Color of joints. */
export const METAL: Rgb = [0.2, 0.21, 0.24];
/** Color of feet without a color of their own. */
const RUBBER: Rgb = [0.11, 0.12, 0.14];
/** Color of things that do not move and have no color. */
const WORLD: Rgb = [0.62, 0.6, 0.56];
/** MuJoCo's default color: the model sets none. */
const UNCHOSEN = 0.5;
/** Viewers hide groups from here on. */
const FIRST_HIDDEN_GROUP = 3;

const unchosen = ({ rgba }: Geom): boolean => rgba.every((x, i) => Math.abs(x - (i < 3 ? UNCHOSEN : 1)) < 1e-6);

/** Geoms that are drawn as shapes: those that MuJoCo's viewer shows, or all that move if it would show none of these. */
export function visibleGeoms(model: ModelInfo): number[] {
  const listed = (geom: Geom): boolean => geom.group < FIRST_HIDDEN_GROUP;
  const allHidden = !model.geoms.some((geom) => geom.body !== 0 && geom.rgba[3] > 0 && listed(geom));
  return model.geoms.flatMap((geom, i) => {
    const drawn = geom.rgba[3] > 0 && (listed(geom) || (allHidden && geom.body !== 0));
    // the scenery draws planes, and courses their own height fields
    return drawn && geom.kind !== "plane" && geom.kind !== "hfield" ? [i] : [];
  });
}

export interface Stuff {
  readonly color: Rgb;
  readonly roughness: number;
  readonly alpha: number;
}

/** Color and surface of a geom. */
export function stuffOf(model: ModelInfo, geom: Geom): Stuff {
  const [r, g, b, alpha] = geom.rgba;
  if (geom.body === 0) return { color: unchosen(geom) ? WORLD : [r, g, b], roughness: 0.9, alpha };
  const name = geom.name.toLowerCase();
  const foot = ["foot", "shoe", "toe", "ankle"].some((word) => name.includes(word));
  if (unchosen(geom) && foot) return { color: RUBBER, roughness: 0.85, alpha };
  const [tint = WORLD] = TINTS;
  const color: Rgb = unchosen(geom) ? tint : [r, g, b];
  // the far leg is darker, so that the two legs of a gait can be told apart
  const left = name.includes("left") && !name.includes("right") && (model.bodies[geom.body]?.parent ?? 0) !== 0;
  const shade = left ? 0.82 : 1;
  return { color: [shade * color[0], shade * color[1], shade * color[2]], roughness: foot ? 0.8 : 0.42, alpha };
}

export interface Palette {
  readonly horizon: Rgb;
  readonly zenith: Rgb;
  /** Color that multiplies the ground's texture. */
  readonly ground: Rgb;
  readonly sun: Rgb;
  /** Strength of the sun, of the light opposite to it, and of the light from the sky. */
  readonly lights: Rgb;
}

export const DAY: Palette = {
  horizon: [0.8, 0.87, 0.93],
  zenith: [0.25, 0.48, 0.78],
  ground: [1.04, 1.01, 0.97],
  sun: [1, 0.96, 0.88],
  lights: [3.1, 0.8, 1.8],
};

/** After sunset, for the dark theme. */
export const DUSK: Palette = {
  horizon: [0.2, 0.22, 0.3],
  zenith: [0.05, 0.07, 0.15],
  ground: [0.62, 0.63, 0.72],
  sun: [1, 0.86, 0.7],
  lights: [2.0, 0.9, 0.8],
};

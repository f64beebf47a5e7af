/** Clips that come with the page, by the names of their files. */
export const CLIPS = ["walk", "run", "dance", "cartwheel", "backflip", "kick"] as const;

/** A clip that plays: the character in the poses of the recording. */
import { Vector3 } from "three";
import type { Clip } from "marathon-rl";
import { Blobs } from "../scene/blobs";
import { Figure } from "../scene/figure";
import type { Level } from "../scene/quality";
import { Skin } from "../scene/skin";
import type { Actor, Stage } from "../scene/stage";

export class ClipPlayer implements Actor {
  readonly clip: Clip;
  paused = false;
  speed = 1;
  /** Time in the clip, s. */
  time = 0;
  onTime: (time: number) => void = () => {};
  readonly #stage: Stage;
  readonly #figure: Figure;
  #skin: Skin | null = null;
  readonly #blobs: Blobs;
  #disposed = false;

  constructor(stage: Stage, clip: Clip) {
    this.#stage = stage;
    this.clip = clip;
    this.#figure = new Figure(clip.model, { agents: 1, joints: true, level: stage.level });
    this.#blobs = new Blobs(clip.model, 1);
    stage.world.add(this.#figure.group, this.#blobs.mesh);
    this.quality(stage.level);
    stage.follow.set("side", 4.6);
    void this.#wear();
  }

  frame(dt: number): Vector3 {
    const { duration } = this.clip.info;
    if (!this.paused && duration > 0) {
      this.time = (this.time + dt * this.speed) % duration;
      this.onTime(this.time);
    }
    // a view lasts until the next call: it is copied
    const bodies = this.clip.bodyPoses(this.time).slice();
    const geoms = this.clip.poses(this.time);
    this.#figure.show(geoms, bodies);
    this.#blobs.show(geoms);
    this.#skin?.show(bodies);
    const [x = 0, y = 0, z = 0] = bodies.subarray(16 + 12, 16 + 15);
    return new Vector3(x, y, Math.max(0.75 * z, 0.3));
  }

  quality(level: Level): void {
    this.#figure.setQuality(level);
    this.#skin?.setQuality(level);
    this.#blobs.setQuality(level);
  }

  dispose(): void {
    this.#disposed = true;
    this.#figure.dispose();
    this.#skin?.dispose();
    this.#blobs.dispose();
    this.clip.free();
  }

  async #wear(): Promise<void> {
    const skin = await Skin.load("MarathonMan", this.clip.model, this.#stage.level).catch(() => null);
    if (this.#disposed) skin?.dispose();
    else if (skin) {
      this.#skin = skin;
      this.#stage.world.add(skin.mesh);
      this.#figure.group.visible = false;
    }
  }
}

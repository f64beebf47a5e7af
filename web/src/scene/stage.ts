/** The picture: renderer, scene, camera, and the loop of frames. Views put their figures into it. */
import { Group, PCFShadowMap, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "three";
import type { Theme } from "../app/theme";
import { FollowCamera } from "./camera";
import { DAY, DUSK } from "./colors";
import { type Level, QualityControl, fixedLevel, pixelRatio, rendersInSoftware } from "./quality";
import { Scenery } from "./scenery";

/** A view's part in each frame. */
export interface Actor {
  /** Advances by seconds of real time. Returns the point to look at. */
  frame(dt: number): Vector3 | null;
  /** The picture's quality has changed. */
  quality?(level: Level): void;
}

/** Longest time of a frame that counts, s. */
const LONGEST = 0.25;

export class Stage {
  readonly canvas: HTMLCanvasElement;
  readonly camera = new PerspectiveCamera(42, 1, 0.05, 1200);
  readonly follow = new FollowCamera();
  readonly scenery: Scenery;
  /** Holds what the present view shows. */
  readonly world = new Group();
  readonly #scene = new Scene();
  readonly #renderer: WebGLRenderer;
  readonly #quality: QualityControl;
  #actor: Actor | null = null;
  #last = 0;
  /** Parts of the picture's left side and bottom that something covers, CSS pixels. */
  #covered: readonly [number, number] = [0, 0];
  /** Frames so far. */
  frames = 0;

  constructor(canvas: HTMLCanvasElement, calm: boolean) {
    this.canvas = canvas;
    const software = rendersInSoftware();
    const fixed = fixedLevel(new URLSearchParams(location.search));
    this.#quality = new QualityControl(software, fixed);
    this.#renderer = new WebGLRenderer({ canvas, antialias: !software || fixed !== null, powerPreference: "high-performance" });
    this.#renderer.shadowMap.type = PCFShadowMap;
    this.scenery = new Scenery(this.#scene);
    this.#scene.add(this.world);
    this.follow.calm = calm;
    this.#applyQuality();
    new ResizeObserver(() => this.#resize()).observe(canvas.parentElement ?? canvas);
    this.#resize();
    requestAnimationFrame((now) => this.#frame(now));
  }

  get level(): Level {
    return this.#quality.level;
  }

  setTheme(theme: Theme): void {
    this.scenery.setPalette(theme === "dark" ? DUSK : DAY);
  }

  /** Moves the middle of the picture to what is not covered. */
  setCovered(left: number, bottom: number): void {
    this.#covered = [left, bottom];
    this.#resize();
  }

  /** Lets a view move the picture, in place of the last one. */
  show(actor: Actor | null): void {
    this.#actor = actor;
    this.follow.cut();
  }

  /** Removes what the last view has left. */
  clear(): void {
    this.show(null);
    this.world.clear();
    this.scenery.setLevel(true);
    this.scenery.setShadows();
  }

  /** The picture as a PNG file. */
  picture(): Promise<Blob | null> {
    // the buffer is empty after the browser has shown it
    this.#renderer.render(this.#scene, this.camera);
    return new Promise((resolve) => this.canvas.toBlob(resolve, "image/png"));
  }

  #frame(now: number): void {
    requestAnimationFrame((next) => this.#frame(next));
    const milliseconds = now - this.#last;
    this.#last = now;
    const dt = Math.min(milliseconds / 1000, LONGEST);
    const target = this.#actor?.frame(dt) ?? null;
    this.follow.update(this.camera, target ?? this.follow.focus.clone(), dt);
    this.scenery.follow(this.camera.position, this.follow.focus);
    this.#renderer.render(this.#scene, this.camera);
    this.frames++;
    if (this.#quality.frame(milliseconds)) this.#applyQuality();
  }

  #applyQuality(): void {
    this.#renderer.shadowMap.enabled = this.level >= 2;
    this.scenery.setQuality(this.level);
    this.#actor?.quality?.(this.level);
    this.#resize();
  }

  #resize(): void {
    const box = this.canvas.parentElement;
    const [width, height] = [Math.max(box?.clientWidth ?? 1, 1), Math.max(box?.clientHeight ?? 1, 1)];
    this.#renderer.setPixelRatio(pixelRatio(this.level));
    this.#renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    // a tall screen must show the figure's width as well
    this.camera.fov = width < height ? 54 : 42;
    const [left, bottom] = [Math.min(this.#covered[0], 0.5 * width), Math.min(this.#covered[1], 0.6 * height)];
    if (left + bottom > 0) this.camera.setViewOffset(width, height, -left / 2, bottom / 2, width, height);
    else this.camera.clearViewOffset();
    this.camera.updateProjectionMatrix();
  }
}

/** Ground, sky and lights. The ground fades into the color of the sky at the horizon, so that its edge is never seen. */
import {
  BackSide,
  CanvasTexture,
  Color,
  DirectionalLight,
  FogExp2,
  Group,
  HemisphereLight,
  Mesh,
  MeshLambertMaterial,
  PlaneGeometry,
  RepeatWrapping,
  SRGBColorSpace,
  type Scene,
  ShaderMaterial,
  SphereGeometry,
  Vector3,
} from "three";
import type { Palette, Rgb } from "./colors";
import type { Level } from "./quality";

/** Cells along a side of the texture, one meter each. */
const PERIOD = 8;
/** Pixels along its side. */
const SIDE = 1024;
/** Half the side of the ground, m; it follows the camera. */
const REACH = 320;
/** Radius of the sky, m. */
const SKY = 600;
/** Density of the haze, 1/m: 24 % of the ground's color is gone at 20 m, 91 % at 60 m. */
const HAZE = 0.026;
/** Depth of the ground below figures that run on height fields alone, m. */
const DEEP = 6;
/** Where the sun stands, and the light that draws an edge around figures. */
const SUN = new Vector3(-0.45, -0.55, 0.8).normalize();
const RIM = new Vector3(0.6, 0.7, 0.35).normalize();
/** Half the side of the area with shadows, m. */
const SHADOWS = 5;

const TONES = ["rgb(122,114,103)", "rgb(143,135,123)"] as const;
const TICK = "rgb(176,167,152)";
const LINE = "rgb(236,231,220)";

export class Scenery {
  readonly #scene: Scene;
  readonly #ground: Mesh<PlaneGeometry, MeshLambertMaterial>;
  readonly #sky: Mesh<SphereGeometry, ShaderMaterial>;
  readonly #sun = new DirectionalLight();
  readonly #rim = new DirectionalLight(new Color(0.8, 0.88, 1));
  readonly #ambient = new HemisphereLight();
  readonly #all = new Group();
  /** The checker, which courses share. */
  readonly checker: CanvasTexture;

  constructor(scene: Scene) {
    this.#scene = scene;
    this.checker = checker();
    const texture = this.checker.clone();
    texture.repeat.set((2 * REACH) / PERIOD, (2 * REACH) / PERIOD);
    this.#ground = new Mesh(new PlaneGeometry(2 * REACH, 2 * REACH), new MeshLambertMaterial({ map: texture }));
    this.#ground.receiveShadow = true;
    this.#sky = new Mesh(new SphereGeometry(SKY, 48, 24), skyMaterial());
    this.#sky.frustumCulled = false;
    this.#sky.renderOrder = -1;
    scene.fog = new FogExp2(0xffffff, HAZE);
    const { shadow } = this.#sun;
    shadow.mapSize.set(2048, 2048);
    this.setShadows(SHADOWS);
    shadow.radius = 4;
    shadow.bias = -0.0004;
    shadow.normalBias = 0.015;
    this.#rim.position.copy(RIM);
    this.#all.add(this.#ground, this.#sky, this.#sun, this.#sun.target, this.#rim, this.#ambient);
    scene.add(this.#all);
  }

  /** Sets half the side of the area with shadows, m. A larger one has coarser shadows. */
  setShadows(half = SHADOWS): void {
    const { camera } = this.#sun.shadow;
    Object.assign(camera, { left: -half, right: half, top: half, bottom: -half, near: 1, far: 40 });
    camera.updateProjectionMatrix();
  }

  /** Without level ground, the floor lies deep below the figures. */
  setLevel(level: boolean): void {
    this.#ground.position.z = level ? 0 : -DEEP;
  }

  setPalette({ horizon, zenith, ground, sun, lights }: Palette): void {
    const color = (rgb: Rgb): Color => new Color().setRGB(...rgb, SRGBColorSpace);
    this.#scene.fog = new FogExp2(color(horizon), HAZE);
    this.#ground.material.color = color(ground);
    // the shader writes sRGB: fog is sRGB too, and both must meet at the horizon
    const { uniforms } = this.#sky.material;
    (uniforms["horizon"] as { value: Vector3 }).value.set(...horizon);
    (uniforms["zenith"] as { value: Vector3 }).value.set(...zenith);
    this.#sun.color = color(sun);
    this.#ambient.color = color(horizon);
    this.#ambient.groundColor = color([0.45, 0.41, 0.36]);
    [this.#sun.intensity, this.#rim.intensity, this.#ambient.intensity] = lights;
  }

  setQuality(level: Level): void {
    this.#sun.castShadow = level >= 2;
    const texture = this.#ground.material.map;
    if (texture) {
      texture.anisotropy = level === 0 ? 1 : 8;
      texture.needsUpdate = true;
    }
    this.#ground.material.needsUpdate = true;
  }

  /** Moves with the camera and with what it looks at. */
  follow(camera: Vector3, focus: Vector3): void {
    // in steps of the texture, so that the ground stands still
    this.#ground.position.x = Math.round(camera.x / PERIOD) * PERIOD;
    this.#ground.position.y = Math.round(camera.y / PERIOD) * PERIOD;
    this.#sky.position.copy(camera);
    this.#sun.position.copy(focus).addScaledVector(SUN, 16);
    this.#sun.target.position.copy(focus);
  }
}

/** One-meter cells, with a tick at every corner and a line every eight meters. */
function checker(): CanvasTexture {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = SIDE;
  const context = canvas.getContext("2d");
  if (context === null) throw new Error("this browser cannot draw on a canvas");
  const cell = SIDE / PERIOD;
  for (let row = 0; row < PERIOD; row++) {
    for (let column = 0; column < PERIOD; column++) {
      context.fillStyle = TONES[(row + column) % 2 === 0 ? 0 : 1];
      context.fillRect(column * cell, row * cell, cell, cell);
    }
  }
  context.fillStyle = TICK;
  for (let row = 0; row <= PERIOD; row++) {
    for (let column = 0; column <= PERIOD; column++) {
      context.fillRect(column * cell - 10, row * cell - 2, 20, 4);
      context.fillRect(column * cell - 2, row * cell - 10, 4, 20);
    }
  }
  context.fillStyle = LINE;
  for (const edge of [0, SIDE - 3]) {
    context.fillRect(edge, 0, 3, SIDE);
    context.fillRect(0, edge, SIDE, 3);
  }
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  texture.wrapS = texture.wrapT = RepeatWrapping;
  return texture;
}

function skyMaterial(): ShaderMaterial {
  return new ShaderMaterial({
    side: BackSide,
    depthWrite: false,
    uniforms: {
      horizon: { value: new Vector3() },
      zenith: { value: new Vector3() },
      sun: { value: SUN },
    },
    vertexShader: `
      varying vec3 direction;
      void main() {
        direction = position;
        gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
      }`,
    fragmentShader: `
      uniform vec3 horizon;
      uniform vec3 zenith;
      uniform vec3 sun;
      varying vec3 direction;
      void main() {
        vec3 way = normalize(direction);
        float height = clamp(asin(clamp(way.z, -1.0, 1.0)) / 1.5708, 0.0, 1.0);
        float towards = max(dot(way, sun), 0.0);
        vec3 color = mix(horizon, zenith, pow(height, 0.75));
        color += vec3(1.0, 0.93, 0.82) * (0.16 * pow(towards, 24.0) + 0.8 * pow(towards, 900.0));
        gl_FragColor = vec4(color, 1.0);
      }`,
  });
}

/** Small models that come with the page. */

export interface Sample {
  readonly name: string;
  readonly label: string;
  readonly xml: string;
}

const GROUND = '<geom type="plane" size="20 20 1"/>';

/** A chain of rods that hangs from the world. */
function chain(links: number): string {
  let xml = "";
  for (let i = links - 1; i >= 0; i--) {
    const place = i === 0 ? "0 0 2.2" : "0 0 -0.3";
    xml =
      `<body name="link${i}" pos="${place}"><joint type="ball" damping="0.02"/>` +
      `<geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.045" rgba="${i % 2 ? "0.13 0.53 0.8" : "0.93 0.42 0.16"} 1"/>${xml}</body>`;
  }
  return `<mujoco model="chain"><worldbody>${GROUND}${xml}</worldbody></mujoco>`;
}

function arm(): string {
  return `<mujoco model="arm">
  <compiler angle="degree"/>
  <default><joint damping="2" armature="0.05"/><position kp="120"/></default>
  <worldbody>${GROUND}
    <geom type="cylinder" pos="0 0 0.2" size="0.16 0.2" rgba="0.3 0.31 0.34 1" contype="0" conaffinity="0"/>
    <body name="base" pos="0 0 0.4"><joint name="turn" axis="0 0 1" range="-160 160"/>
      <geom type="cylinder" size="0.13 0.06" pos="0 0 0.06" rgba="0.93 0.42 0.16 1" mass="2" contype="0" conaffinity="0"/>
      <body name="upper" pos="0 0 0.14"><joint name="lift" axis="0 1 0" range="-100 100"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.6" size="0.07" rgba="0.93 0.42 0.16 1" mass="2"/>
        <body name="fore" pos="0 0 0.6"><joint name="bend" axis="0 1 0" range="-140 140"/>
          <geom type="capsule" fromto="0 0 0 0 0 0.5" size="0.055" rgba="0.88 0.86 0.8 1" mass="1.2"/>
          <body name="hand" pos="0 0 0.5"><joint name="tilt" axis="0 1 0" range="-110 110"/>
            <geom type="box" size="0.06 0.09 0.05" pos="0 0 0.06" rgba="0.13 0.53 0.8 1" mass="0.4"/>
          </body></body></body></body>
    <body name="box" pos="0.8 0.2 0.15"><freejoint/><geom type="box" size="0.14 0.14 0.14" rgba="0.22 0.65 0.38 1" mass="1"/></body>
  </worldbody>
  <actuator><position joint="turn" ctrlrange="-160 160"/><position joint="lift" ctrlrange="-100 100"/>
    <position joint="bend" ctrlrange="-140 140"/><position joint="tilt" ctrlrange="-110 110"/></actuator>
</mujoco>`;
}

/** A wall of boxes and a heavy ball. */
function wall(): string {
  let boxes = "";
  for (let row = 0; row < 4; row++) {
    for (let column = 0; column < 4 - (row % 2); column++) {
      const x = (column - 1.5 + 0.5 * (row % 2)) * 0.44;
      const color = ["0.8 0.27 0.46", "0.88 0.66 0.14", "0.1 0.62 0.62"][(row + column) % 3] ?? "1 1 1";
      boxes += `<body pos="0 ${x.toFixed(3)} ${(0.15 + 0.301 * row).toFixed(3)}"><freejoint/><geom type="box" size="0.12 0.21 0.15" rgba="${color} 1" mass="0.8"/></body>`;
    }
  }
  const ball = '<body name="ball" pos="-1.6 0 0.3"><freejoint/><geom type="sphere" size="0.28" rgba="0.2 0.21 0.24 1" mass="8"/></body>';
  return `<mujoco model="wall"><worldbody>${GROUND}${boxes}${ball}</worldbody></mujoco>`;
}

/** Balls and boxes that roll down a bowl with bumps. */
function bowl(): string {
  const [side, half] = [41, 2.5];
  const heights: string[] = [];
  for (let i = 0; i < side * side; i++) {
    const [x, y] = [((i % side) / (side - 1)) * 2 - 1, (Math.floor(i / side) / (side - 1)) * 2 - 1];
    heights.push((0.35 * (x * x + y * y) + 0.1 * (1 + Math.sin(7 * x) * Math.cos(6 * y))).toFixed(3));
  }
  let bodies = "";
  for (let i = 0; i < 9; i++) {
    const place = `${(((i % 3) - 1) * 1.2).toFixed(2)} ${((Math.floor(i / 3) - 1) * 1.2).toFixed(2)} 1.9`;
    const color = ["0.93 0.42 0.16", "0.13 0.53 0.8", "0.22 0.65 0.38"][i % 3] ?? "1 1 1";
    const shape = i % 2 ? 'type="box" size="0.16 0.12 0.1"' : 'type="sphere" size="0.16"';
    bodies += `<body pos="${place}"><freejoint/><geom ${shape} rgba="${color} 1" mass="1" condim="6" friction="1 0.01 0.002"/></body>`;
  }
  return `<mujoco model="bowl"><asset><hfield name="bowl" nrow="${side}" ncol="${side}" size="${half} ${half} 1 0.2"
    elevation="${heights.join(" ")}"/></asset><worldbody><geom type="hfield" hfield="bowl"/>${bodies}</worldbody></mujoco>`;
}

export const SAMPLES: readonly Sample[] = [
  { name: "arm", label: "Arm", xml: arm() },
  { name: "chain", label: "Chain", xml: chain(7) },
  { name: "wall", label: "Wall", xml: wall() },
  { name: "bowl", label: "Bowl", xml: bowl() },
];

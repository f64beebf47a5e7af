// Drops files on the page. `files` are names and bytes.
export function drop(page, files) {
  const plain = files.map(([name, bytes]) => [name, Buffer.from(bytes).toString("base64")]);
  return page.evaluate((given) => {
    const data = new DataTransfer();
    for (const [name, text] of given) {
      data.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
    }
    document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
  }, plain);
}

/** A recording of a few frames: a skeleton with the bone names of Mixamo that lifts its arms. */
export function bvh(frames = 60) {
  const joint = (name, offset, children = "") => `JOINT ${name} { OFFSET ${offset} CHANNELS 3 Zrotation Xrotation Yrotation ${children} }`;
  const end = (offset) => `End Site { OFFSET ${offset} }`;
  const arm = (side, sign) =>
    joint(`${side}Shoulder`, `${sign * 4} 12 0`, joint(`${side}Arm`, `${sign * 12} 0 0`, joint(`${side}ForeArm`, `${sign * 27} 0 0`, joint(`${side}Hand`, `${sign * 25} 0 0`, end(`${sign * 8} 0 0`)))));
  const leg = (side, sign) =>
    joint(`${side}UpLeg`, `${sign * 9} -4 0`, joint(`${side}Leg`, "0 -42 0", joint(`${side}Foot`, "0 -41 0", joint(`${side}ToeBase`, "0 -5 12", end("0 0 6")))));
  const spine = joint("Spine", "0 10 0", joint("Spine1", "0 12 0", joint("Spine2", "0 12 0", joint("Neck", "0 14 0", joint("Head", "0 9 0", end("0 18 0"))) + arm("Left", 1) + arm("Right", -1))));
  const tree = `ROOT Hips { OFFSET 0 0 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation ${spine} ${leg("Left", 1)} ${leg("Right", -1)} }`;
  const joints = [...tree.matchAll(/(ROOT|JOINT) (\w+)/g)].map((match) => match[2]);
  const rows = Array.from({ length: frames }, (_, frame) =>
    joints
      .map((name, i) => {
        const turn = name === "LeftArm" ? -60 + 40 * Math.sin(frame / 8) : name === "RightArm" ? 60 - 40 * Math.sin(frame / 8) : 0;
        return `${i === 0 ? "0 93 0 " : ""}${turn.toFixed(2)} 0 0`;
      })
      .join(" "),
  );
  return `HIERARCHY\n${tree.replaceAll(/([{}])/g, "\n$1\n").replaceAll(/(OFFSET|CHANNELS|JOINT|End Site)/g, "\n$1")}\nMOTION\nFrames: ${frames}\nFrame Time: 0.0333333\n${rows.join("\n")}\n`;
}

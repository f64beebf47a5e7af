/** Paths of files that belong to a model. All have slashes and no `.` or `..`. */

/** A path without `.`, `..` and double slashes. */
export function normalize(path: string): string {
  const parts: string[] = [];
  for (const part of path.replaceAll("\\", "/").split("/")) {
    if (part === "..") parts.pop();
    else if (part !== "" && part !== ".") parts.push(part);
  }
  return parts.join("/");
}

/** The folder of a path, with a slash at its end, or nothing. */
export function folderOf(path: string): string {
  return path.slice(0, path.lastIndexOf("/") + 1);
}

/** Address of a model: `github:owner/repo/path.xml`, `github:owner/repo@branch/path.xml`, or an address of the web. */
export function addressOf(model: string, base: string): URL {
  const github = /^github:([\w.-]+)\/([\w.-]+?)(?:@([^/]+))?\/(.+)$/.exec(model);
  if (github) {
    const [, owner = "", repository = "", branch = "HEAD", path = ""] = github;
    return new URL(normalize(path), `https://raw.githubusercontent.com/${owner}/${repository}/${branch}/`);
  }
  if (model.startsWith("github:")) throw new Error(`${model} is not like github:owner/repo/path.xml`);
  const url = new URL(model, base);
  if (!/^https?:$/.test(url.protocol)) throw new Error(`${model} is not an address of the web`);
  return url;
}

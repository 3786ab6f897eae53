// @ts-check
/**
 * Small structured texts as plain values: JSON, the part of YAML that cameras and poses are written in, OpenCV's XML, and
 * lines of `name = value`. No comments, anchors or block scalars are kept, and of several YAML documents the first.
 */

/** @typedef {{ [name: string]: Value }} Fields without a prototype, or as JSON gives them */
/** @typedef {number | string | boolean | null | Value[] | { [name: string]: unknown }} Value */

/**
 * @param {string} text
 * @returns {Value} null: it is none of these
 */
export function readDocument(text) {
  const trimmed = text.replace(/^\uFEFF/, '').trim();
  try {
    if (/^[{[]/.test(trimmed)) return /** @type {Value} */ (JSON.parse(trimmed));
    if (trimmed.startsWith('<')) return readXml(trimmed.replace(/^<\?xml[^>]*\?>\s*/, ''));
    return readYaml(trimmed);
  } catch {
    return null; // broken, or nested deeper than the stack
  }
}

/** @returns {Fields} */
function fields() {
  return Object.create(null);
}

/** @param {string} text @returns {Value} */
function scalar(text) {
  const bare = text.replace(/^!\S*\s*/, '').trim();
  const [, quoted] = bare.match(/^"(.*)"$|^'(.*)'$/)?.filter((part) => part !== undefined) ?? [];
  if (quoted !== undefined) return quoted;
  return bare !== '' && Number.isFinite(Number(bare)) ? Number(bare) : bare;
}

// YAML.

/** @typedef {{ indent: number, text: string }} Line */

/** @param {string} text @returns {Value} */
function readYaml(text) {
  /** @type {Line[]} */
  const lines = [];
  for (const raw of text.split(/\r?\n/)) {
    const line = raw.replace(/(^|\s)#.*$/, '').trimEnd();
    if (/^(---|\.\.\.)/.test(line)) {
      if (lines.length > 0) break;
      continue;
    }
    if (line.trim() === '' || line.startsWith('%')) continue;
    const last = lines.at(-1);
    if (last && isOpen(last.text)) last.text += ` ${line.trim()}`;
    else lines.push({ indent: line.length - line.trimStart().length, text: line.trim() });
  }
  return new YamlBlocks(lines).read(0);
}

/** Whether a bracket is not closed yet. @param {string} text */
function isOpen(text) {
  const opened = text.match(/[[{]/g)?.length ?? 0;
  return opened > (text.match(/[\]}]/g)?.length ?? 0);
}

const KEY = /^(?:"([^"]*)"|'([^']*)'|([^\s:[\]{}][^:]*?))\s*:(?:\s+|(?=[[{])|$)(.*)$/;

class YamlBlocks {
  #lines;
  #at = 0;

  /** @param {Line[]} lines */
  constructor(lines) {
    this.#lines = lines;
  }

  /** The block that begins at the present line. @param {number} indent at least @returns {Value} */
  read(indent) {
    const line = this.#lines[this.#at];
    if (!line || line.indent < indent) return null;
    if (/^-(\s|$)/.test(line.text)) return this.#sequence(line.indent);
    if (KEY.test(line.text)) return this.#mapping(line.indent);
    this.#at += 1;
    return inline(line.text);
  }

  /** @param {number} indent @returns {Value[]} */
  #sequence(indent) {
    /** @type {Value[]} */
    const items = [];
    for (let line = this.#here(indent); line && /^-(\s|$)/.test(line.text); line = this.#here(indent)) {
      const rest = line.text.slice(1).trimStart();
      if (rest === '') {
        this.#at += 1;
        items.push(this.read(indent + 1));
      } else {
        // What follows the dash is a block of its own, as far in as it stands.
        this.#lines[this.#at] = { indent: indent + line.text.length - rest.length, text: rest };
        items.push(this.read(indent + 1));
      }
    }
    return items;
  }

  /** @param {number} indent @returns {Fields} */
  #mapping(indent) {
    const found = fields();
    for (let line = this.#here(indent); line; line = this.#here(indent)) {
      const [, double, single, bare, rest = ''] = line.text.match(KEY) ?? [];
      const name = double ?? single ?? bare;
      if (name === undefined) break;
      this.#at += 1;
      const value = rest.replace(/^!\S*\s*/, '');
      const next = this.#lines[this.#at];
      const isList = next?.indent === indent && /^-(\s|$)/.test(next.text);
      found[name] = value === '' ? this.read(isList ? indent : indent + 1) : inline(value);
    }
    return found;
  }

  /** The present line where it stands this far in. @param {number} indent */
  #here(indent) {
    const line = this.#lines[this.#at];
    return line?.indent === indent ? line : null;
  }
}

/** `[1, 2]`, `{ a: 1 }` or a single value. @param {string} text @returns {Value} */
function inline(text) {
  if (!/^[[{]/.test(text)) return scalar(text);
  const tokens = text.match(/[[\]{},]|"[^"]*"|[^[\]{},"]+/g) ?? [];
  let at = 0;
  /** @returns {Value} */
  const value = () => {
    const token = tokens[at++] ?? '';
    if (token === '[') {
      /** @type {Value[]} */
      const items = [];
      for (skip(); at < tokens.length && tokens[at] !== ']'; skip()) items.push(value());
      at += 1;
      return items;
    }
    if (token !== '{') return scalar(token);
    const found = fields();
    for (skip(); at < tokens.length && tokens[at] !== '}'; skip()) {
      const [, name = '', rest = ''] = (tokens[at++] ?? '').match(/^\s*([^:]*?)\s*:\s*(.*)$/) ?? [];
      found[name] = rest.trim() === '' ? value() : scalar(rest);
    }
    at += 1;
    return found;
  };
  const skip = () => {
    while (/^(,|\s+)$/.test(tokens[at] ?? '')) at += 1;
  };
  return value();
}

// XML.

/** Elements of one name are a list; the attributes are left out. @param {string} text @returns {Value} */
function readXml(text) {
  const found = fields();
  let hasElements = false;
  const bare = text.replaceAll(/<!--.*?-->/gs, '');
  for (const [, name = '', content = ''] of bare.matchAll(/<([\w.:-]+)(?:\s[^>]*)?>(.*?)<\/\1>/gs)) {
    const value = readXml(content);
    const before = found[name];
    hasElements = true;
    found[name] = before === undefined ? value : Array.isArray(before) ? [...before, value] : [before, value];
  }
  return hasElements ? found : words(bare);
}

/** One value, or a list of numbers separated by blanks or commas. @param {string} text @returns {Value} */
function words(text) {
  const parts = text
    .trim()
    .split(/[\s,;]+/)
    .map(scalar);
  return parts.length > 1 && parts.every((part) => typeof part === 'number') ? parts : scalar(text.trim());
}

/**
 * Lines of `name = value` or `name: value`, in sections that begin with `[NAME]` or, as rs-enumerate-devices has them,
 * with `Intrinsic of "NAME" / WIDTHxHEIGHT`.
 * @param {string} text
 * @returns {Fields}
 */
export function readLabels(text) {
  const all = fields();
  let section = all;
  for (const line of text.split(/\r?\n/)) {
    const [, title] = line.match(/^\s*\[([^\]]+)\]\s*$/) ?? line.match(/^\s*(Intrinsic of ".*)$/) ?? [];
    if (title !== undefined) {
      section = fields();
      all[title] = section;
      continue;
    }
    const [, name, value] = line.match(/^\s*([A-Za-z][^:=]*?)\s*[:=]\s*(.*?)\s*$/) ?? [];
    if (name !== undefined && value !== undefined) section[name] = words(value.replaceAll(/[[\]]/g, ' '));
  }
  return all;
}

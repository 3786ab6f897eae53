/**
 * Small structured texts as plain values: JSON, the part of YAML that cameras and poses are written in, OpenCV's XML, and
 * lines of `name = value`. No comments, anchors or block scalars are kept, and of several YAML documents the first.
 */

/** Without a prototype, or as JSON gives them. */
type Fields = { [name: string]: Value };
type Value = number | string | boolean | null | Value[] | { [name: string]: unknown };

/** @returns null: it is none of these */
export function readDocument(text: string): Value {
  const trimmed = text.replace(/^\uFEFF/, '').trim();
  try {
    if (/^[{[]/.test(trimmed)) return JSON.parse(trimmed) as Value;
    if (trimmed.startsWith('<')) return readXml(trimmed.replace(/^<\?xml[^>]*\?>\s*/, ''));
    return readYaml(trimmed);
  } catch {
    return null; // broken, or nested deeper than the stack
  }
}

function fields(): Fields {
  return Object.create(null);
}

function scalar(text: string): Value {
  const bare = text.replace(/^!\S*\s*/, '').trim();
  const [, quoted] = bare.match(/^"(.*)"$|^'(.*)'$/)?.filter((part) => part !== undefined) ?? [];
  if (quoted !== undefined) return quoted;
  return bare !== '' && Number.isFinite(Number(bare)) ? Number(bare) : bare;
}

// YAML.

type Line = { indent: number; text: string };

function readYaml(text: string): Value {
  const lines: Line[] = [];
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

/** Whether a bracket is not closed yet. */
function isOpen(text: string) {
  const opened = text.match(/[[{]/g)?.length ?? 0;
  return opened > (text.match(/[\]}]/g)?.length ?? 0);
}

const KEY = /^(?:"([^"]*)"|'([^']*)'|([^\s:[\]{}][^:]*?))\s*:(?:\s+|(?=[[{])|$)(.*)$/;

class YamlBlocks {
  #lines;
  #at = 0;

  constructor(lines: Line[]) {
    this.#lines = lines;
  }

  /**
   * The block that begins at the present line.
   * @param indent at least
   */
  read(indent: number): Value {
    const line = this.#lines[this.#at];
    if (!line || line.indent < indent) return null;
    if (/^-(\s|$)/.test(line.text)) return this.#sequence(line.indent);
    if (KEY.test(line.text)) return this.#mapping(line.indent);
    this.#at += 1;
    return inline(line.text);
  }

  #sequence(indent: number): Value[] {
    const items: Value[] = [];
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

  #mapping(indent: number): Fields {
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

  /** The present line where it stands this far in. */
  #here(indent: number) {
    const line = this.#lines[this.#at];
    return line?.indent === indent ? line : null;
  }
}

/** `[1, 2]`, `{ a: 1 }` or a single value. */
function inline(text: string): Value {
  if (!/^[[{]/.test(text)) return scalar(text);
  const tokens = text.match(/[[\]{},]|"[^"]*"|[^[\]{},"]+/g) ?? [];
  let at = 0;
  const value = (): Value => {
    const token = tokens[at++] ?? '';
    if (token === '[') {
      const items: Value[] = [];
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

/** Elements of one name are a list; the attributes are left out. */
function readXml(text: string): Value {
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

/** One value, or a list of numbers separated by blanks or commas. */
function words(text: string): Value {
  const parts = text
    .trim()
    .split(/[\s,;]+/)
    .map(scalar);
  return parts.length > 1 && parts.every((part) => typeof part === 'number') ? parts : scalar(text.trim());
}

/**
 * Lines of `name = value` or `name: value`, in sections that begin with `[NAME]` or, as rs-enumerate-devices has them,
 * with `Intrinsic of "NAME" / WIDTHxHEIGHT`.
 */
export function readLabels(text: string): Fields {
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

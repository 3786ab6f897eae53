/**
 * The part of the page's address that an element keeps something in. The first element has the fragment; others, which have an id, each a
 * part behind it: `#metric=point_to_point&@right=max_range%3D5`.
 */
export class Address {
  /** What the part begins with; empty for the fragment itself. */
  readonly #mark: string;

  /** `id`: of the element; without, it has the fragment itself. */
  constructor(id = '') {
    this.#mark = id && `@${encodeURIComponent(id)}=`;
  }

  /** The part as a fragment of its own; empty where there is none. */
  get fragment(): string {
    return this.of(location.hash);
  }

  /** Its part of this fragment. */
  of(hash: string): string {
    const all = partsOf(hash);
    if (this.#mark === '') return fragmentOf(all.filter((part) => !part.startsWith('@')));
    const own = all.find((part) => part.startsWith(this.#mark));
    // Somebody may have changed it: what is no escape stays as it is.
    return own ? fragmentOf([new URLSearchParams(`own=${own.slice(this.#mark.length)}`).get('own') ?? '']) : '';
  }

  /** Puts this in its place; those of other elements stay. */
  write(fragment: string): void {
    const own = fragment.replace(/^#/, '');
    const all = partsOf(location.hash);
    const next =
      this.#mark === ''
        ? [own, ...all.filter((part) => part.startsWith('@'))]
        : [...all.filter((part) => !part.startsWith(this.#mark)), own && this.#mark + encodeURIComponent(own)];
    history.replaceState(history.state, '', fragmentOf(next) || location.pathname + location.search);
  }
}

/** That of the first element. */
export const WHOLE = new Address();

const partsOf = (hash: string): string[] => hash.replace(/^#/, '').split('&');

function fragmentOf(parts: readonly string[]): string {
  const text = parts.filter((part) => part !== '').join('&');
  return text === '' ? '' : `#${text}`;
}

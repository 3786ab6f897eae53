/**
 * `make`, made again only when an argument is another one than last time. What the components are given then stays the
 * same object while nothing in it changed, and they need not draw.
 */
export function memoizeLast<A extends readonly unknown[], R>(make: (...args: A) => R): (...args: A) => R {
  let last: { args: A; result: R } | null = null;
  return (...args) => {
    if (last === null || !args.every((arg, i) => Object.is(arg, last?.args[i]))) last = { args, result: make(...args) };
    return last.result;
  };
}

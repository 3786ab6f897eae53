// @ts-check
/** What `scanstitch/element` is on a server, where pages are rendered without elements: nothing. */
export {};

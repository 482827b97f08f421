// A catalogue's keys and the values that each message takes, read off the messages themselves.
import type en from "./en.js";

export type Catalogue = typeof en;
export type Key = keyof Catalogue;
export type Values = Record<string, string | number>;

/** A message, or its forms by plural category; `count` chooses the form. */
export type Entry = string | { one: string; other: string };

type NamesIn<S> = S extends `${string}{${infer Name}}${infer Rest}` ? Name | NamesIn<Rest> : never;
type NamesOf<E> = E extends string ? NamesIn<E> : "count" | NamesIn<E[keyof E]>;
/** What follows the key of such an entry: nothing, or one record with every value that the message names. */
export type ValuesIn<E, V = string | number> = [NamesOf<E>] extends [never] ? [] : [Record<NamesOf<E>, V>];

/** What follows the key in t(key, …). */
export type ValuesOf<K extends Key, V = string | number> = ValuesIn<Catalogue[K], V>;

// A catalogue's keys and the values that each message takes, read off the messages themselves.
import type en from "./en.js";

export type Catalogue = typeof en;
export type Key = keyof Catalogue;
export type Values = Record<string, string | number>;

/** A message, or its forms by plural category; `count` chooses the form. */
export type Entry = string | { one: string; other: string };

type NamesIn<S> = S extends `${string}{${infer Name}}${infer Rest}` ? Name | NamesIn<Rest> : never;
export type NamesOf<K extends Key> = Catalogue[K] extends string
  ? NamesIn<Catalogue[K]>
  : "count" | NamesIn<Catalogue[K][keyof Catalogue[K]]>;

/** What follows the key in t(key, …): nothing, or one record with every value that the message names. */
export type ValuesOf<K extends Key, V = string | number> = [NamesOf<K>] extends [never] ? [] : [Record<NamesOf<K>, V>];

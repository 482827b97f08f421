// What the page's modules reach for while they load: an address, two stores, languages, listeners and the root element.
const listeners = new EventTarget();

class Store {
  #kept = new Map();
  getItem = (name) => this.#kept.get(name) ?? null;
  setItem = (name, value) => void this.#kept.set(name, String(value));
  removeItem = (name) => void this.#kept.delete(name);
}

const location = { hash: "", href: "http://127.0.0.1/" };
const write = (_state, _title, address) => {
  location.hash = address;
};

Object.defineProperty(navigator, "languages", { value: ["en-GB"], writable: true });
Object.assign(globalThis, {
  document: { documentElement: { dataset: {} }, hidden: false },
  location,
  history: { pushState: write, replaceState: write },
  localStorage: new Store(),
  sessionStorage: new Store(),
  matchMedia: () => ({ matches: false, addEventListener: () => {} }),
  addEventListener: listeners.addEventListener.bind(listeners),
  dispatchEvent: listeners.dispatchEvent.bind(listeners),
});

/** As when a person writes another address, or goes back. */
export function goTo(address) {
  location.hash = address;
  dispatchEvent(new Event("hashchange"));
}

/* Opens a replay file, as the one script in it: the page's modules and the logs stand in the page, packed.

   Each module becomes an address that holds all of it, and an import map gives these addresses to the names by which
   modules import each other. So the files are the same here, in the service's page and in the tests. */

(async () => {
  /** The text that an element holds, as bytes packed by gzip and written in base 64.
      @type {(element: Element) => Promise<string>} */
  async function unpacked(element) {
    const bytes = Uint8Array.from(atob(element.textContent.trim()), (letter) => letter.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  }

  /** Let modules be imported by their names.
      @type {(modules: Record<string, string>) => void} */
  function offer(modules) {
    const addresses = Object.entries(modules).map(([name, source]) => [
      name,
      `data:text/javascript;charset=utf-8,${encodeURIComponent(source)}`,
    ]);
    const map = document.createElement("script");
    map.type = "importmap";
    map.textContent = JSON.stringify({ imports: Object.fromEntries(addresses) });
    document.head.append(map);
  }

  /** The texts of all elements of a kind.
      @type {(kind: string) => Promise<string[]>} */
  function texts(kind) {
    return Promise.all([...document.querySelectorAll(`script.${kind}`)].map(unpacked));
  }

  const [[modules], logs] = await Promise.all([texts("modules"), texts("log")]);
  offer(JSON.parse(modules));
  const [{ show }, { readMission }, { saveButton }] = await Promise.all([
    import("#page/app.js"),
    import("#log/model.js"),
    import("#page/saving.js"),
  ]);
  const missions = logs.map(readMission);
  const named = logs.map((text, i) => {
    const { scenario, strategy } = missions[i].start;
    return { text, name: `${scenario}-${strategy}` };
  });
  const save = saveButton(named.length, () => named);
  show(document.querySelector("#app") ?? document.body, missions, { save });
})();

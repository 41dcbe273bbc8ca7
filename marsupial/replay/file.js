/* Opens a replay file, as the one script in it: the page's modules and the logs stand in the page, packed.

   Each module becomes an address that holds all of it, and an import map gives these addresses to the names by which
   modules import each other. So the files are the same here, in the service's page and in the tests. */

(async () => {
  /** The text that an element holds, as bytes packed by gzip and written in base 64. */
  async function unpacked(element) {
    const bytes = Uint8Array.from(atob(element.textContent.trim()), (letter) => letter.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  }

  /** Let modules be imported by their names. */
  function offer(modules) {
    const address = ([name, source]) => [name, `data:text/javascript;charset=utf-8,${encodeURIComponent(source)}`];
    const map = document.createElement("script");
    map.type = "importmap";
    map.textContent = JSON.stringify({ imports: Object.fromEntries(Object.entries(modules).map(address)) });
    document.head.append(map);
  }

  offer(JSON.parse(await unpacked(document.querySelector("script.modules"))));
  const [{ show }, { readMission }, { saveButton }] = await Promise.all([
    import("#page/app.js"),
    import("#log/model.js"),
    import("#page/saving.js"),
  ]);
  const texts = await Promise.all([...document.querySelectorAll("script.log")].map(unpacked));
  const missions = texts.map(readMission);
  const logs = texts.map((text, i) => ({ text, name: `${missions[i].start.scenario}-${missions[i].start.strategy}` }));
  show(document.getElementById("app"), missions, { save: saveButton(logs.length, () => logs) });
})();

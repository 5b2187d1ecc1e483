// Puts the page together from its data block.
const data = JSON.parse(document.getElementById("data").textContent);
if (data.scene === null) {
  document.body.classList.add("empty");
} else {
  const clock = makeClock(unpack(data.scene.t));
  clock.series = unpack(data.t);
  const bodies = document.getElementById("bodies");
  data.scene.bodies.forEach((body, i) => {
    const item = bodies.appendChild(document.createElement("li"));
    item.textContent = body.name;
    item.style.setProperty("--colour", `var(--${bodyColour(i)})`);
  });
  makeControls(clock);
  makeScene(document.getElementById("scene"), data.scene, clock, data.flow);
  makeCharts(data.panels, clock, document.getElementById("charts"));
}

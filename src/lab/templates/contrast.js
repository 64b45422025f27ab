for (const contrast of document.querySelectorAll(".contrast")) {
  const stack = contrast.querySelector(".stack");
  const over = contrast.querySelector(".second img").cloneNode();
  over.className = "pixels over";
  over.alt = "";
  const line = document.createElement("span");
  line.className = "line";
  const slider = document.createElement("input");
  slider.type = "range";
  slider.step = 0.5;
  slider.setAttribute("aria-label", "A is shown left of this place, B right of it, in per cent of the width");
  const show = () => {
    over.style.clipPath = `inset(0 0 0 ${slider.value}%)`;
    line.style.left = `${slider.value}%`;
  };
  slider.addEventListener("input", show);
  stack.addEventListener("pointermove", (event) => {
    const frame = stack.getBoundingClientRect();
    slider.value = (100 * (event.clientX - frame.left)) / frame.width;
    show();
  });
  stack.append(over, line);
  stack.after(slider);
  contrast.classList.add("live");
  show();
}

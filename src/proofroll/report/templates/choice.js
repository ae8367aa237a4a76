// The first screen has a part for each tolerance; the one that is chosen is shown, and stands in the address.
(() => {
  const choice = document.getElementById("tolerance");
  if (!choice) return;
  const first = choice.value, parts = [...document.querySelectorAll("[data-tolerance]")];
  function show() {
    parts.forEach((part) => { part.hidden = part.dataset.tolerance !== choice.value; });
  }
  choice.addEventListener("change", () => { address.ask(choice); show(); });
  address.keep(
    (words) => { if (choice.value !== first) words.set("tol", choice.value); },
    (words) => {
      choice.value = words.get("tol") ?? first;
      if (choice.selectedIndex < 0) choice.value = first;
      show();
    },
  );
  document.querySelectorAll(".ask").forEach((form) => form.addEventListener("submit", (event) => event.preventDefault()));
})();

// Each viewer: two pictures, one over the other, the upper one cut where the slider stands.
for (const viewer of document.querySelectorAll('.viewer')) {
  const find = (name) => viewer.querySelector(`[data-role="${name}"]`);
  const [left, right, kind, slider] = ['left', 'right', 'kind', 'slider'].map(find);
  const [under, over] = viewer.querySelectorAll('.stage img');
  const source = (mode) => {
    const picture = document.getElementById(`${viewer.dataset.tilt}/${mode}/${kind.value}`);
    return picture ? picture.src : '';
  };
  const show = () => {
    under.src = source(left.value);
    over.src = source(right.value);
    under.alt = left.value;
    over.alt = right.value;
    over.style.clipPath = `inset(0 0 0 ${slider.value}%)`;
    viewer.querySelector('.stage').classList.toggle('part', kind.value.endsWith('part'));
  };
  for (const control of [left, right, kind, slider]) control.addEventListener('input', show);
  show();
}

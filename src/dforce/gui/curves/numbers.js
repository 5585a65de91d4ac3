// The numbers behind the curves, a row for each point.
export default {
  template: `
    <div class="df-differences df-numbers" role="region" :aria-label="label" tabindex="0">
      <p v-if="text" class="df-text">{{ text }}</p>
      <table>
        <thead><tr><th v-for="(head, n) in heads" :key="n" scope="col" :title="head">{{ head }}</th></tr></thead>
        <tbody><tr v-for="(row, n) in rows" :key="n"><td v-for="(cell, k) in row" :key="k">{{ cell }}</td></tr></tbody>
      </table>
    </div>`,
  props: { label: { default: "numbers of the curves" }, heads: { default: () => [] }, rows: { default: () => [] }, text: { default: "" } },
};

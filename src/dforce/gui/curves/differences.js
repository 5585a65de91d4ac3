// The parameters in which results differ, a column for each result.
export default {
  template: `
    <div class="df-differences" role="region" aria-label="differences" tabindex="0">
      <p v-if="!rows.length" class="df-text">{{ text }}</p>
      <table v-else>
        <thead><tr><th scope="col">parameter</th>
          <th v-for="(name, n) in names" :key="n" scope="col" :title="name">
            <span class="df-dot" :style="{'--df-dot': 'var(--df-series-' + colors[n] + ')'}"></span>{{ name }}</th></tr></thead>
        <tbody><tr v-for="row in rows" :key="row.path">
          <th scope="row" :title="row.path">{{ row.label }} <span class="df-symbol" v-html="row.symbol"></span></th>
          <td v-for="(value, n) in row.values" :key="n">{{ value }}</td></tr></tbody>
      </table>
    </div>`,
  props: { rows: { default: () => [] }, names: { default: () => [] }, colors: { default: () => [] }, text: { default: "" } },
};

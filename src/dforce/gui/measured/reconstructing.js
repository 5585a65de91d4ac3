// The force behind a measured curve: the reconstruction, and its lever.
export default {
  template: `
    <section class="df-rebuild" aria-label="reconstruction">
      <div><p class="df-text">The force that {{ name }} needs, without any model of the sample.</p>
        <p v-if="unconfirmed" class="df-motion-note" id="df-unbuilt">{{ unconfirmed }}</p>
        <div class="df-measured-buttons">
          <button v-if="!busy" type="button" class="df-plain df-main-button" :disabled="!!unconfirmed"
                  :aria-describedby="unconfirmed ? 'df-unbuilt' : undefined" @click="$emit('start')">Reconstruct the force</button>
          <button v-else type="button" class="df-plain" @click="$emit('stop')">Stop</button>
          <progress v-if="busy" max="1" :value="share || undefined" aria-label="progress of the reconstruction"></progress>
          <button v-if="done" type="button" class="df-plain" @click="$emit('keep')">Keep this force</button></div>
        <p v-if="failed" class="df-motion-note wrong" role="alert">{{ failed }}</p>
        <template v-if="done">
          <p v-if="stale" class="df-motion-note">This force is of another curve, shift or lever.</p>
          <p class="df-text">Force {{ whole(holds_for) }}. The band is ±2 standard errors.</p>
          <ul class="df-facts df-gaps" role="status"><li v-for="one in gaps" :key="one">{{ whole(one) }}</li></ul></template></div>
      <div v-show="done" class="df-rebuilt-chart" :class="{'df-behind': stale}"><slot></slot></div>
    </section>`,
  props: {
    name: { default: "" }, unconfirmed: { default: "" }, busy: Boolean, share: { default: 0 }, failed: { default: "" },
    done: Boolean, stale: Boolean, holds_for: { default: "" }, gaps: { default: () => [] },
  },
  methods: { whole: (text) => window.dforceWhole(text) },
};

// The pieces of advice, as a list.
export default {
  template: `<ul class="df-pieces"><li v-for="one in pieces" :key="one">{{ whole(one) }}</li></ul>`,
  props: { pieces: { default: () => [] } },
  methods: { whole: (text) => window.dforceWhole(text) },
};

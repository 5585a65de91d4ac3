// The answer above the chart, in letters that let it stand in two lines.
const LONG = 150; // characters that are more than two lines of large letters

export default {
  template: `<div class="df-answer" :class="{'df-long': now.length > LONG}" role="status">{{ whole(now) }}</div>`,
  props: { text: { default: "" } },
  data() {
    return { taken: null, LONG };
  },
  computed: {
    now() {
      return this.taken ?? this.text;
    },
  },
  watch: {
    text() {
      this.taken = null;
    },
  },
  methods: {
    whole: (text) => window.dforceWhole(text),
    // a text that changes many times a second comes this way: a property would draw the whole page anew
    take(text) {
      this.taken = text;
    },
  },
};

// How the search orders what it finds: pages by what they are called and define, then what the library has.
var Scorer = {
  score: ([page, , , description, score]) => score - (description ? 200 : 0) - (/^book\/api\b|^genindex|^_modules/.test(page) ? 100 : 0),
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 60,
  partialTitle: 20,
  term: 5,
  partialTerm: 2,
};

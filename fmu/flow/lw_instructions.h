/* The widest set of vector instructions that loops may be compiled for: it is chosen when the program runs. */
#ifndef LW_INSTRUCTIONS_H
#define LW_INSTRUCTIONS_H

typedef enum { LW_PLAIN, LW_AVX2, LW_AVX512 } lw_instructions;

/* The widest one that processor and system have. */
lw_instructions lw_instructions_here(void);

#endif

/* Coefficients of the Rosenbrock methods of rosenbrock.c, in the form of Hairer and Wanner, Solving ODEs II, sec. IV.7:
   one matrix shift I - J a step, shift = 1/(gamma h). A row of zeros in A is a stage without an evaluation.
   RODAS3: A. Sandu et al., Benchmarking stiff ODE solvers for atmospheric chemistry problems II, Atmos. Environ. 31
   (1997) 3459. RODAS4: E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, 2nd ed. (1996), sec. VI.4. */
#define RODAS3_STAGES 4
static const double RODAS3_GAMMA = 0.5;
static const double RODAS3_ALPHA[4] = {0.0, 0.0, 1.0, 1.0};
static const double RODAS3_GAMMA_SUM[4] = {0.5, 1.5, 0.0, 0.0};
static const double RODAS3_M[4] = {2.0, 0.0, 1.0, 1.0};
static const double RODAS3_A[4][4] = {
    {0.0, 0.0, 0.0, 0.0},
    {0.0, 0.0, 0.0, 0.0},
    {2.0, 0.0, 0.0, 0.0},
    {2.0, 0.0, 1.0, 0.0},
};
static const double RODAS3_C[4][4] = {
    {0.0, 0.0, 0.0, 0.0},
    {4.0, 0.0, 0.0, 0.0},
    {1.0, -1.0, 0.0, 0.0},
    {1.0, -1.0, -2.6666666666666665, 0.0},
};
#define RODAS4_STAGES 6
static const double RODAS4_GAMMA = 0.25;
static const double RODAS4_ALPHA[6] = {0.0, 0.386, 0.21, 0.63, 1.0, 1.0};
static const double RODAS4_GAMMA_SUM[6] = {0.25, -0.1043, 0.1035, -0.03620000000000023, 0.0, 0.0};
static const double RODAS4_M[6] = {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687886036105895, 1.0, 1.0};
static const double RODAS4_A[6][6] = {
    {0.0, 0.0, 0.0, 0.0, 0.0, 0.0},
    {1.544, 0.0, 0.0, 0.0, 0.0, 0.0},
    {0.9466785280815826, 0.2557011698983284, 0.0, 0.0, 0.0, 0.0},
    {3.314825187068521, 2.896124015972201, 0.9986419139977817, 0.0, 0.0, 0.0},
    {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687886036105895, 0.0, 0.0},
    {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687886036105895, 1.0, 0.0},
};
static const double RODAS4_C[6][6] = {
    {0.0, 0.0, 0.0, 0.0, 0.0, 0.0},
    {-5.6688, 0.0, 0.0, 0.0, 0.0, 0.0},
    {-2.430093356833875, -0.2063599157091915, 0.0, 0.0, 0.0, 0.0},
    {-0.1073529058151375, -9.594562251023355, -20.47028614809616, 0.0, 0.0, 0.0},
    {7.496443313967647, -10.24680431464352, -33.99990352819905, 11.7089089320616, 0.0, 0.0},
    {8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054, 0.0},
};

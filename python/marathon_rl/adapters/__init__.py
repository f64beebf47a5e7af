"""The environments in the dress of other libraries, a module for each; a module needs its library, the package none.

* `sb3.Sb3VecEnv`: Stable-Baselines3
* `pettingzoo.MarathonParallelEnv`: PettingZoo, many agents in one world
* `rsl_rl.RslRlEnv`: rsl_rl
* `skrl.SkrlEnv`: skrl
* `dm_env.DmEnv`: dm_env
"""

"""What a mission believes of its world: the map that plans are made from, and the robots as they are planned for.

Read `belief` first. Its filters are `pace` (speeds learned), `radio` (rovers out of contact), `steady` with `flicker`
(cells that flicker), and `zones` (of operators); `vain` finds what no look reveals.
"""

#!/bin/bash
# Fetches the maps of real buildings, which marsupial does not include, into a folder, and checks them:
#   bash benchmarks/real-maps.sh ../shared/maps
# The last part needs the Python of marsupial. Licences: docs/comparisons.md.
set -eu
mkdir -p "$1"
cd "$1"
get() {   # name, image, metres a cell, thresholds, address
    curl -fo "$2" "https://raw.githubusercontent.com/$6"
    printf 'image: %s\nresolution: %s\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: %s\nfree_thresh: %s\n' "$2" "$3" "$4" "$5" > "$1.yaml"
}
d=goldleaf3i/declutter-reconstruct/ae0149d43b234a6f312fb7f7aa7bc402f5198f1d/MAPFILES/MAPS
n=ros-navigation/navigation2/a3a97043ee93d92fe8d70ec56d183933169beb1c/nav2_bringup/maps
get fr079 fr079.png 0.05 0.65 0.196 $d/Various/BORMANN/freiburg_building79.png
get cartesium cartesium.png 0.05 0.4 0.05 $d/Various/ubremen-cartesium-demo4.gfs.log_no_alpha.png
get fr101 fr101.png 0.05 0.65 0.196 $d/Various/BORMANN/freiburg_building101.png
get depot_nav2_fixed depot_nav2.pgm 0.05 0.65 0.15 $n/depot.pgm
get warehouse_aws warehouse_aws.png 0.05 0.65 0.196 aws-robotics/aws-robomaker-small-warehouse-world/3c23a698bf0b4e366ddf8b084af507c519bd3483/maps/005/map_rotated.png
get diag_floor1 diag_floor1.pgm 0.05 0.6 0.4 davidbsp/patrolling_sim/560839a2116a30eded22dd73765141aa1edaafd9/maps/DIAG_floor1/DIAG_floor1.pgm
get tsc_office tsc_office.pgm 0.05 0.65 0.196 $d/strands_maps/strands_maps/tsc_y4/maps/tsc_1701.pgm
get warehouse_nav2 warehouse_nav2.pgm 0.03 0.65 0.1 $n/warehouse.pgm
sha256sum -c <<end
dc8e2abd27d9d1bfeee50207c18825bef19df3ec58c1f8f80cc5bf3d6e576c18  fr079.png
22971edb5dc085600bb450f4d31302c4079e6038ff1899d61464f99f53100353  cartesium.png
aea64b69d9d4403da5348d825c3017af151b5ab7217a9da407535c90a3215534  fr101.png
71bbac79cfc2f5db89095182bfa86b29d96b07d4ed3b7726e513ed57afffc851  depot_nav2.pgm
73fe0596f70e5984145284cbe48ff7ab9d8af95c44a6676ff88e77344f8dc574  warehouse_aws.png
bd95bd7b6e44953fe5c81a4a9fe85e0ca89d11083809165cc55555a5b077494f  diag_floor1.pgm
cc8838e08c97cb28e0bd28b42bc0eb429132ff7cdb764ab262e7a9b1db7a6947  tsc_office.pgm
934ce2ca1feacc2216b68142349c6ebb3e46cc7c76fd80a9c2d2a6fb85ba7ff7  warehouse_nav2.pgm
end

mkdir -p buildings && cd buildings
get fr052 fr052.pgm 0.05 0.65 0.196 $d/Various/BORMANN/freiburg_building52.pgm
get uma236 uma236.pgm 0.05 0.65 0.196 $d/Giraff/UMA_236.pgm
get g4s g4s.pgm 0.05 0.65 0.196 $d/strands_morse/g4s/g4s_y2.pgm
get home_sarmis home_sarmis.pgm 0.05 0.65 0.196 $d/Giraff/Sarmis2_map_adj.pgm
get movecare_lab movecare_lab.pgm 0.05 0.65 0.196 $d/Giraff/movecare_map_integrationmeeting1903.pgm
sha256sum -c <<end
fead67a5d7bd233223cd9ed9e0f43beb67905dbf004d067f59b234f271be7dcf  fr052.pgm
c3d8da67fd6fcc5b9574a34cf598643e7ef00c247344fa271b1db5088d134940  uma236.pgm
ba8594359804c6ad909387999d78ae2ce53acc57207e42ea560dd2e0630f36ad  g4s.pgm
daf6e3f983a587dbf66b42b4a227172b6995a90bb5d9662dd8945b2c6d478299  home_sarmis.pgm
7e2895be4fe797eb628b37565c8276ab1db5a548bc8cd84d0fb6003907b2cbe8  movecare_lab.pgm
end

k=castacks/MapEx/b607ed3dcbf03ba65811cced35a25968fbbc454a/kth_test_maps
floor() {   # name, folder: the walls and rooms of a floor plan, as arrays
    get "$1" "$1.png" 0.1 0.65 0.196 "$k/$2/occ_map.npy" && mv "$1.png" "$1.walls.npy"
    curl -fo "$1.rooms.npy" "https://raw.githubusercontent.com/$k/$2/valid_space.npy"
}
floor kth_a1 50010535_PLAN1
floor kth_a2 50010535_PLAN2
floor kth_a3 50010536_PLAN3
floor kth_b1 50037764_PLAN1
floor kth_b3 50037765_PLAN3
floor kth_c0 50052748
floor kth_c1 50052749
floor kth_c2 50052750
python - > kth.sums <<end
from hashlib import sha256
from pathlib import Path
import numpy as np
from PIL import Image
from scipy.ndimage import binary_dilation

for file in sorted(Path().glob("*.walls.npy")):
    name = file.name.removesuffix(".walls.npy")
    inside = binary_dilation(np.load(f"{name}.rooms.npy") > 0, iterations=8)  # the rooms and their open doors
    free = inside & (np.load(file) > 0)
    walls = inside | binary_dilation(free, np.ones((3, 3)), iterations=2)  # where inside is not free, and around it
    cells = np.where(free, 254, np.where(walls, 0, 205)).astype(np.uint8)
    cells = np.pad(cells, 3, constant_values=205)
    Image.fromarray(cells).save(f"{name}.png")
    print(sha256(cells).hexdigest(), "", name)
end
sort -k 2 kth.sums | diff - <(sort -k 2 <<end
54ee2c5897b411deed81bfd6fb2a03df064e930df146ed565714d731012b115c  kth_a1
17398bb846d4f0642213137a4dd8c5a018705991b8c2386d66591b4c5e35fbef  kth_a2
bed9457e760861e7584dd1b028add5217a4b6fc053a97054fd5a87a1326b7996  kth_a3
d50c8d2fb1376b39921e4fe22ff4c0b406775ad73595c7ea5eeb59c163ef97ce  kth_b1
7b78902a114cbd30b490ef01fbefb4a30e738416c5321f43742f2f7a2ae83321  kth_b3
c2f33df2db922206e7c51a40856030bde8d0062a2a4d8f144be62b17d72653c9  kth_c0
4e77d42621b68cd347d31a3acb86564e50f2b3ba6153d75189399fd20355c1cd  kth_c1
8e7b65d474169d1d3c11235b159200eadaa37c2f09f03b0da804eb2caed74835  kth_c2
end
) && echo 'all maps are those of the suites'
